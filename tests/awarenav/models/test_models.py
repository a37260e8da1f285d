"""Networks of the catalogue: fetched, verified, and refused when their sha256 is another."""

from __future__ import annotations

import hashlib
import http.server
import io
import threading
import zipfile
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from paths import SHARED

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.estimate import NetworkChoice
from awarenav.models import (
    Catalogue,
    ModelStore,
    NetworkSet,
    RealModel,
    _download,
    default_folder,
)

MODELS = SHARED / "models"
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
    monkeypatch.setattr(_download, "_RETRIES", 0)
    folder = tmp_path_factory.mktemp("served")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder)) as it:
        it.folder, it.requests = folder, []
        threading.Thread(target=it.serve_forever, args=(0.01,), daemon=True).start()
        yield it
        it.shutdown()


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def zipped(**files: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name.replace("__", "/"), content)
    return buffer.getvalue()


def model(server, path: str, content: bytes | None = None, **changes: object) -> RealModel:
    """Return a network at ``path`` of the server, which serves the content there."""
    if content is not None:
        (server.folder / path).write_bytes(content)
    facts = {
        "name": "tiny",
        "role": "detector",
        "url": f"http://127.0.0.1:{server.server_port}/{path}",
        "size_mb": 1.0,
        "licence": "Apache-2.0",
        "publisher": "nobody",
        "purpose": "tests",
    }
    return RealModel.model_validate(facts | changes)


def store(folder: Path, entry: RealModel) -> ModelStore:
    return ModelStore(folder, Catalogue(models=(entry,)))


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_pinned_network_is_fetched_once_and_verified(server, tmp_path):
    fetched = store(tmp_path / "new", model(server, "a.onnx", CONTENT, sha256=sha256(CONTENT)))
    with pytest.raises(AwarenavError, match="awarenav models fetch tiny"):
        fetched.path("tiny")
    path, downloaded = fetched.fetch("tiny", progress=False)
    assert downloaded
    assert path.read_bytes() == CONTENT
    assert path.stat().st_mode & 0o444 == 0o444  # another user may run the robot
    assert fetched.path("tiny") == path
    assert fetched.fetch("tiny", progress=False) == (path, False)
    assert server.requests == ["/a.onnx"]
    path.write_bytes(CONTENT[:-1])
    with pytest.raises(AwarenavError, match=f"{sha256(CONTENT[:-1])}, expected {sha256(CONTENT)}"):
        fetched.path("tiny")
    assert fetched.fetch("tiny", progress=False) == (path, True)
    assert fetched.path("tiny") == path
    assert names(tmp_path / "new") == {"tiny.onnx"}


def test_network_in_an_archive_lands_at_its_own_name_whatever_its_path_there(server, tmp_path):
    content = zipped(**{"..__..__end2end.onnx": CONTENT, "note.txt": b""})
    entry = model(server, "a.zip", content, member="end2end.onnx", sha256=sha256(CONTENT))
    path, _ = store(tmp_path, entry).fetch("tiny", progress=False)
    assert path.read_bytes() == CONTENT
    assert names(tmp_path) == {"tiny.onnx"}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (zipped(**{"x__end2end.onnx": CONTENT})[:2000], "not a complete ZIP archive"),
        (b"<html>please log in</html>", "not a complete ZIP archive"),
        (zipped(other=CONTENT), "0 entries called end2end.onnx; it holds other"),
        (zipped(**{"a__end2end.onnx": CONTENT, "b__end2end.onnx": OTHER}), "2 entries"),
        (zipped(**{"end2end.onnx": OTHER}), f"{sha256(OTHER)}, expected {sha256(CONTENT)}"),
    ],
    ids=["half", "login page", "none", "two", "another file"],
)
def test_archive_without_the_network_leaves_nothing_behind(server, tmp_path, content, message):
    entry = model(server, "a.zip", content, member="end2end.onnx", sha256=sha256(CONTENT))
    with pytest.raises(AwarenavError, match=message):
        store(tmp_path, entry).fetch("tiny", progress=False)
    assert names(tmp_path) == set()


def test_download_with_a_wrong_sha256_is_dropped_and_the_old_file_stays(server, tmp_path):
    (tmp_path / "tiny.onnx").write_bytes(b"what was there")
    fetched = store(tmp_path, model(server, "a.onnx", OTHER, sha256=sha256(CONTENT)))
    with pytest.raises(AwarenavError, match=f"{sha256(OTHER)}, expected {sha256(CONTENT)}"):
        fetched.fetch("tiny", progress=False)
    assert (tmp_path / "tiny.onnx").read_bytes() == b"what was there"
    assert names(tmp_path) == {"tiny.onnx"}


def test_first_fetch_is_trusted_and_later_ones_must_match_it(server, tmp_path):
    entry = model(server, "a.onnx", CONTENT)
    fetched = store(tmp_path, entry)
    path, _ = fetched.fetch("tiny", progress=False)
    assert fetched.path("tiny") == path
    assert (tmp_path / "tiny.sha256").read_text() == f"{sha256(CONTENT)}  tiny.onnx\n"
    path.unlink()
    model(server, "a.onnx", OTHER)
    with pytest.raises(AwarenavError, match=f"{sha256(OTHER)}, expected {sha256(CONTENT)}"):
        fetched.fetch("tiny", progress=False)
    with pytest.raises(AwarenavError, match="the first fetch says"):
        fetched.fetch("tiny", sha256=sha256(OTHER), progress=False)
    path.write_bytes(OTHER)
    with pytest.raises(AwarenavError, match="altered"):
        fetched.load("tiny")


def test_download_must_have_the_sha256_of_the_user(server, tmp_path):
    fetched = store(tmp_path, model(server, "a.onnx", CONTENT))
    with pytest.raises(AwarenavError, match="expected"):
        fetched.fetch("tiny", sha256=sha256(OTHER), progress=False)
    assert names(tmp_path) == set()
    fetched.fetch("tiny", sha256=sha256(CONTENT), progress=False)
    assert fetched.expected_sha256("tiny") == sha256(CONTENT)


def test_file_that_was_not_fetched_is_refused(server, tmp_path):
    (tmp_path / "tiny.onnx").write_bytes(CONTENT)
    with pytest.raises(AwarenavError, match="not put there"):
        store(tmp_path, model(server, "a.onnx")).path("tiny")


def test_missing_file_and_server_are_named_with_what_works_without(server, tmp_path):
    with pytest.raises(AwarenavError, match=r"the server answers 404 .*b\.onnx"):
        store(tmp_path, model(server, "b.onnx")).fetch("tiny", progress=False)
    gone = model(server, "a.onnx", url="http://127.0.0.1:9/a.onnx")
    with pytest.raises(
        AwarenavError, match=r"no connection to 127.* on another computer"
    ) as raised:
        store(tmp_path, gone).fetch("tiny", progress=False)
    assert "\n" not in str(raised.value)
    assert names(tmp_path) == set()


def test_broken_connection_leaves_nothing_behind(server, tmp_path, monkeypatch):
    def half(self: Quiet) -> None:
        self.send_response(200)
        self.send_header("Content-Length", str(len(CONTENT)))
        self.end_headers()
        self.wfile.write(CONTENT[:1000])

    monkeypatch.setattr(Quiet, "do_GET", half)
    with pytest.raises(AwarenavError, match="no connection to 127"):
        store(tmp_path, model(server, "a.onnx")).fetch("tiny", progress=False)
    assert names(tmp_path) == set()


def test_folder_that_cannot_be_made_is_named(server, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(AwarenavError, match=r"cannot write to .*file"):
        store(tmp_path / "file" / "models", model(server, "a.onnx")).fetch("tiny")
    assert server.requests == []


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
    assert {entry.licence for entry in catalogue.models} <= {"Apache-2.0", "MIT", "BSD-3-Clause"}
    assert all(urlsplit(entry.url).scheme == "https" for entry in catalogue.models)
    assert {"detector", "pose"} <= {entry.role for entry in catalogue.models}
    with pytest.raises(AwarenavError, match=r"AGPL-3\.0.*not fetched"):
        catalogue["yolov8"]


@pytest.mark.skipif(not MODELS.is_dir(), reason="no genuine networks beside the checkout")
def test_catalogue_knows_the_genuine_detector():
    content = (MODELS / "rtmdet_nano_person_320_mmpose.onnx").read_bytes()
    assert Catalogue.shipped()["rtmdet-nano"].sha256 == sha256(content)


@pytest.mark.parametrize(
    "change",
    [
        {"licence": "AGPL-3.0"},
        {"url": "ftp://somewhere/a.onnx"},
        {"url": "https://somewhere/a.zip"},
        {"member": "end2end.onnx"},
        {"sha256": "abc"},
        {"name": "../up"},
    ],
)
def test_catalogue_entries_that_are_refused(server, change):
    with pytest.raises(ValueError, match="RealModel"):
        model(server, "a.onnx", **change)


@pytest.fixture
def catalogue(server, monkeypatch, tmp_path):
    """The command's catalogue, with two networks and a set of both on loopback."""
    shipped = Catalogue.shipped()
    networks = (
        model(server, "a.onnx", CONTENT, sha256=sha256(CONTENT), note="a test"),
        model(server, "b.onnx", OTHER, name="small", role="pose", sha256=sha256(OTHER)),
    )
    both = NetworkSet(name="robot", detector="tiny", pose="small", head="pnp", purpose="tests")
    local = shipped.model_copy(update={"models": networks, "sets": (both,)})
    monkeypatch.setattr(Catalogue, "shipped", classmethod(lambda _: local))
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "models"))
    return local


def test_command_lists_fetches_and_verifies(catalogue, server, tmp_path, capsys):
    assert main(["models", "list"]) == 0
    listing = capsys.readouterr().out
    assert "Shipped, for the simulator; they have seen no real person" in listing
    assert listing.count("trained on renders") == 3
    assert listing.count("trained on photographs") == 2
    assert "robot           tiny, small, head from pnp" in listing
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


def test_a_set_is_fetched_and_named_in_a_file_for_the_networks_option(
    catalogue, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert main(["models", "fetch", "robot"]) == 0
    assert "robot: written to robot_networks.yaml" in capsys.readouterr().out
    chosen = NetworkChoice.from_yaml("robot_networks.yaml")
    assert chosen == NetworkChoice(detector="tiny", pose="small", head="pnp")
    assert (tmp_path / "models" / "tiny.onnx").read_bytes() == CONTENT
    assert (tmp_path / "models" / "small.onnx").read_bytes() == OTHER
    # Somebody's own file is not replaced; in another folder the networks are named by their paths.
    assert main(["models", "fetch", "robot", "--out", "other"]) == 2
    assert "other contents" in capsys.readouterr().err
    Path("robot_networks.yaml").unlink()
    assert main(["models", "fetch", "robot", "--out", "other"]) == 0
    chosen = NetworkChoice.from_yaml("robot_networks.yaml")
    assert (chosen.detector, chosen.pose) == tuple(
        str(tmp_path / "other" / name) for name in ("tiny.onnx", "small.onnx")
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"detector": "small"}, "must name networks of these roles"),
        ({"pose": "nothing"}, "must name networks of these roles"),
        ({"name": "tiny"}, "is a network and a set"),
    ],
)
def test_sets_that_make_no_sense_are_refused(catalogue, change, message):
    good = catalogue.sets[0].model_dump()
    with pytest.raises(ValueError, match=message):
        Catalogue(models=catalogue.models, sets=(NetworkSet(**(good | change)),))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fetch", "tny"], "did you mean 'tiny'"),
        (["fetch", "robot", "--sha256", "0" * 64], "single name"),
        (["fetch", "yolov8"], "AGPL-3.0"),
        (["fetch", "tiny", "other", "--sha256", "0" * 64], "single name"),
        (["fetch", "tiny", "--sha256", "0" * 64], "the catalogue says"),
    ],
)
def test_command_refuses_in_one_line(catalogue, server, arguments, message, capsys):
    assert main(["models", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert server.requests == []


def test_text_that_is_not_a_sha256_is_refused(catalogue, capsys):
    assert main(["models", "fetch", "tiny", "--sha256", "abc"]) == 2
    assert "64 hexadecimal digits" in capsys.readouterr().err
