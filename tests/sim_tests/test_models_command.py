from __future__ import annotations

import hashlib
import http.client
import io
import json
import shutil
import urllib.request
import zipfile
from pathlib import Path

import pytest
from model_server import ModelServer

from sim_tests import SimError
from sim_tests._cli import main
from sim_tests.models import _download, _store
from sim_tests.models._archive import extract_member
from sim_tests.models._catalogue import Catalogue, RealModel
from sim_tests.models._download import BrokenDownloadError, download
from sim_tests.models._store import ModelStore, default_folder

SHARED = Path(__file__).resolve().parents[3] / "shared" / "models"
# No network, and quite enough to tell whole from half and old from new.
CONTENT = bytes(range(256)) * 4000
OTHER = CONTENT[::-1]


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def zipped(**files: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name.replace("__", "/"), content)
    return buffer.getvalue()


@pytest.fixture
def server():
    with ModelServer() as running:
        yield running


def model(server: ModelServer, path: str, **changes: object) -> RealModel:
    facts = {
        "name": "tiny",
        "role": "detector",
        "url": server.url(path),
        "size_mb": 1.0,
        "licence": "Apache-2.0",
        "publisher": "nobody",
        "purpose": "tests",
    }
    return RealModel.model_validate(facts | changes)


def store(folder: Path, entry: RealModel) -> ModelStore:
    return ModelStore(folder, Catalogue(models=(entry,)))


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.endswith(".lock")}


# Downloads


def test_download_appears_whole(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    download(server.url("a.onnx"), tmp_path / "a.onnx", progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert names(tmp_path) == {"a.onnx"}


def test_download_goes_on_where_it_broke_off(server, tmp_path):
    server.serve("a.onnx", CONTENT, cuts=[300_000, 400_000, None])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert [request.get("range") for request in server.requests] == [
        None,
        "bytes=300000-",
        "bytes=700000-",
    ]
    assert {request.get("if-range") for request in server.requests[1:]} == {'"1"'}


def test_next_run_goes_on_too_and_says_so(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT, cuts=[500_000])
    with pytest.raises(BrokenDownloadError, match=r"after 500000 bytes.*run it again"):
        download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert not target.exists()
    download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert target.read_bytes() == CONTENT
    assert server.requests[-1]["range"] == "bytes=500000-"


@pytest.mark.parametrize("etag", [None, 'W/"1"'])
def test_date_stands_in_for_a_strong_tag(server, tmp_path, etag):
    server.serve("a.onnx", CONTENT, etag=etag, cuts=[500_000])
    server.files["a.onnx"].etag = None  # then the server compares the date
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert server.requests[-1]["if-range"].startswith("Thu, 01 Jan 1970")


def test_halves_of_two_files_are_never_joined(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT, cuts=[500_000])
    with pytest.raises(BrokenDownloadError):
        download(server.url("a.onnx"), target, attempts=1, progress=False)
    server.serve("a.onnx", OTHER, etag='"2"')
    download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert target.read_bytes() == OTHER


def test_part_of_another_address_is_not_gone_on_with(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT, cuts=[500_000])
    server.serve("b.onnx", OTHER)  # with the same tag
    with pytest.raises(BrokenDownloadError):
        download(server.url("a.onnx"), target, attempts=1, progress=False)
    download(server.url("b.onnx"), target, attempts=1, progress=False)
    assert target.read_bytes() == OTHER


def test_server_without_ranges_sends_it_all_again(server, tmp_path):
    server.serve("a.onnx", CONTENT, ranges=False, cuts=[500_000, 200_000, None])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT


def test_finished_part_whose_move_was_interrupted(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT)
    (tmp_path / "a.onnx.part").write_bytes(CONTENT)
    note = {"url": server.url("a.onnx"), "validator": '"1"'}
    (tmp_path / "a.onnx.part.json").write_text(json.dumps(note))
    download(server.url("a.onnx"), target, pause_s=0.0, progress=False)
    assert target.read_bytes() == CONTENT


@pytest.mark.parametrize("note", ["", "[]", "{", '{"url": 3}', '{"validator": "x"}'])
def test_damaged_note_means_starting_anew(server, tmp_path, note):
    server.serve("a.onnx", CONTENT)
    (tmp_path / "a.onnx.part").write_bytes(b"rubbish")
    (tmp_path / "a.onnx.part.json").write_text(note)
    download(server.url("a.onnx"), tmp_path / "a.onnx", progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT


def test_busy_server_is_asked_again_and_a_missing_file_is_not(server, tmp_path):
    server.serve("a.onnx", CONTENT, refusals=[503, 429])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    server.requests.clear()
    with pytest.raises(SimError, match="404"):
        download(server.url("gone.onnx"), tmp_path / "gone.onnx", progress=False)
    assert len(server.requests) == 1
    assert names(tmp_path) == {"a.onnx"}


def test_nobody_at_the_address(tmp_path):
    with ModelServer() as closed:
        url = closed.url("a.onnx")
    with pytest.raises(SimError, match="no connection"):
        download(url, tmp_path / "a.onnx", attempts=2, pause_s=0.0, progress=False)
    assert names(tmp_path) == set()


def test_redirects_are_followed_with_the_range(server, tmp_path):
    server.serve("a.onnx", b"", redirect=server.url("b.onnx"))
    server.serve("b.onnx", CONTENT, cuts=[500_000])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert server.requests[-1]["range"] == "bytes=500000-"


def test_redirect_that_drops_the_encryption_is_refused():
    request = urllib.request.Request("https://somewhere/a.onnx")
    follow = _download._NoDowngrade().redirect_request
    arguments = (request, io.BytesIO(), 302, "Found", http.client.HTTPMessage())
    with pytest.raises(SimError, match="not encrypted"):
        follow(*arguments, "http://elsewhere/a.onnx")
    assert follow(*arguments, "https://elsewhere/a.onnx").full_url == "https://elsewhere/a.onnx"


# Archives


def test_member_is_found_in_any_folder_and_lands_where_it_should(tmp_path):
    archive = tmp_path / "a.zip"
    archive.write_bytes(zipped(**{"2023__x__end2end.onnx": CONTENT, "2023__x__deploy.json": b"{}"}))
    extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")
    assert (tmp_path / "out.onnx").read_bytes() == CONTENT
    assert names(tmp_path) == {"a.zip", "out.onnx"}


def test_hostile_paths_stay_inside(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    archive = inner / "a.zip"
    archive.write_bytes(zipped(**{"..__..__end2end.onnx": CONTENT, "__etc__evil": b"x"}))
    extract_member(archive, "end2end.onnx", inner / "out.onnx")
    assert (inner / "out.onnx").read_bytes() == CONTENT
    assert names(tmp_path) == {"inner"}


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"a__end2end.onnx": b"1", "b__end2end.onnx": b"2"}, "2 entries called end2end.onnx"),
        ({"readme.txt": b"1"}, "no entry called end2end.onnx; it holds readme.txt"),
        ({"not_end2end.onnx": b"1"}, "no entry"),
    ],
)
def test_archive_without_the_one_file(tmp_path, files, message):
    archive = tmp_path / "a.zip"
    archive.write_bytes(zipped(**files))
    with pytest.raises(SimError, match=message):
        extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")


def test_several_networks_are_told_apart_by_folder(tmp_path):
    archive = tmp_path / "a.zip"
    archive.write_bytes(zipped(**{"x__det__end2end.onnx": b"1", "x__pose__end2end.onnx": b"2"}))
    extract_member(archive, "pose/end2end.onnx", tmp_path / "out.onnx")
    assert (tmp_path / "out.onnx").read_bytes() == b"2"


@pytest.mark.parametrize("keep", [0, 10, 0.5, 0.999])
def test_truncated_archive_is_refused(tmp_path, keep):
    whole = zipped(**{"x__end2end.onnx": CONTENT})
    archive = tmp_path / "a.zip"
    archive.write_bytes(whole[: keep if isinstance(keep, int) else int(keep * len(whole))])
    with pytest.raises(SimError, match="no whole ZIP archive"):
        extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")


def test_damaged_entry_is_refused(tmp_path):
    whole = bytearray(zipped(**{"end2end.onnx": CONTENT}))
    whole[len(whole) // 2] ^= 0xFF
    archive = tmp_path / "a.zip"
    archive.write_bytes(whole)
    with pytest.raises(SimError, match="no whole ZIP archive"):
        extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")


# The store


def test_pinned_network_is_fetched_once_and_verified(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(SimError, match="awarenav models fetch tiny"):
        fetched.path("tiny")
    path, downloaded = fetched.fetch("tiny", progress=False)
    assert downloaded
    assert path.read_bytes() == CONTENT
    assert fetched.path("tiny") == path
    assert fetched.fetch("tiny", progress=False) == (path, False)
    assert len(server.requests) == 1


def test_network_in_an_archive(server, tmp_path):
    server.serve("a.zip", zipped(**{"x__end2end.onnx": CONTENT}), cuts=[100])
    entry = model(server, "a.zip", member="end2end.onnx", sha256=sha256(CONTENT))
    path, _ = store(tmp_path, entry).fetch("tiny", progress=False, pause_s=0.0)
    assert path.read_bytes() == CONTENT
    assert names(tmp_path) == {"tiny.onnx", "models.lock.json"}


def test_truncated_archive_leaves_nothing_behind(server, tmp_path):
    whole = zipped(**{"x__end2end.onnx": CONTENT})
    server.serve("a.zip", whole[: len(whole) // 2])
    entry = model(server, "a.zip", member="end2end.onnx", sha256=sha256(CONTENT))
    with pytest.raises(SimError, match="no whole ZIP archive"):
        store(tmp_path, entry).fetch("tiny", progress=False)
    assert names(tmp_path) == set()


def test_wrong_hash_is_thrown_away_and_what_was_there_stays(server, tmp_path):
    server.serve("a.onnx", OTHER)
    (tmp_path / "tiny.onnx").write_bytes(b"what was there")
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(SimError) as refused:
        fetched.fetch("tiny", progress=False)
    assert sha256(OTHER) in str(refused.value)
    assert sha256(CONTENT) in str(refused.value)
    assert (tmp_path / "tiny.onnx").read_bytes() == b"what was there"
    assert names(tmp_path) == {"tiny.onnx"}
    with pytest.raises(SimError, match="altered"):
        fetched.path("tiny")


def test_altered_network_is_noticed_and_replaced(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    path, _ = fetched.fetch("tiny", progress=False)
    path.write_bytes(CONTENT[:-1])
    with pytest.raises(SimError, match=f"{sha256(CONTENT[:-1])}, expected {sha256(CONTENT)}"):
        fetched.path("tiny")
    assert fetched.fetch("tiny", progress=False) == (path, True)
    assert fetched.path("tiny") == path


def test_login_page_is_not_trusted_on_first_use(server, tmp_path):
    server.serve("a.onnx", b"<html>please log in</html>")
    fetched = store(tmp_path, model(server, "a.onnx"))
    with pytest.raises(SimError, match="is no network"):
        fetched.fetch("tiny", progress=False)
    assert fetched.locked() == {}
    assert names(tmp_path) == set()


@pytest.mark.skipif(not SHARED.is_dir(), reason="no genuine networks beside the checkout")
def test_first_fetch_is_trusted_and_later_ones_held_to_it(server, tmp_path):
    first = (SHARED / "yolox_nano_416_coco.onnx").read_bytes()
    second = (SHARED / "rtmdet_nano_person_320_mmpose.onnx").read_bytes()
    server.serve("a.onnx", first)
    fetched = store(tmp_path, model(server, "a.onnx"))
    path, _ = fetched.fetch("tiny", progress=False)
    assert fetched.locked()["tiny"].sha256 == sha256(first)
    assert not fetched.locked()["tiny"].pinned
    assert fetched.load("tiny").inputs[0].shape == (1, 3, 416, 416)
    path.write_bytes(second)
    with pytest.raises(SimError, match="altered"):
        fetched.load("tiny")
    path.unlink()
    server.serve("a.onnx", second, etag='"2"')
    with pytest.raises(SimError, match=f"{sha256(second)}, expected {sha256(first)}"):
        fetched.fetch("tiny", progress=False)
    with pytest.raises(SimError, match="the first fetch says"):
        fetched.fetch("tiny", sha256=sha256(second), progress=False)


def test_users_hash_is_held_to(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx"))
    with pytest.raises(SimError, match="expected"):
        fetched.fetch("tiny", sha256=sha256(OTHER), progress=False)
    fetched.fetch("tiny", sha256=sha256(CONTENT), progress=False)
    assert fetched.locked()["tiny"].pinned
    pinned = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(SimError, match="the catalogue says"):
        pinned.fetch("tiny", sha256=sha256(OTHER), progress=False)


def test_file_that_nobody_fetched_is_not_believed(server, tmp_path):
    (tmp_path / "tiny.onnx").write_bytes(CONTENT)
    with pytest.raises(SimError, match="not put there"):
        store(tmp_path, model(server, "a.onnx")).path("tiny")


@pytest.mark.parametrize("text", ["{", "[]", '{"models": {"tiny": {}}}', '{"models": 3}'])
def test_damaged_lock_trusts_nothing(server, tmp_path, text):
    (tmp_path / "models.lock.json").write_text(text)
    server.serve("a.onnx", CONTENT)
    with pytest.raises(SimError, match=r"models\.lock\.json cannot be read"):
        store(tmp_path, model(server, "a.onnx")).fetch("tiny", progress=False)
    assert server.requests == []


def test_two_fetches_of_one_network_at_once_are_refused(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with (
        fetched._alone(fetched.catalogue["tiny"]),
        pytest.raises(SimError, match="being fetched"),
    ):
        fetched.fetch("tiny", progress=False)
    assert fetched.fetch("tiny", progress=False)[1]


def test_folder_that_cannot_be_made(server, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimError, match="cannot make"):
        store(tmp_path / "file" / "models", model(server, "a.onnx")).fetch("tiny")


def test_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("AWARENAV_MODELS", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_folder() == tmp_path / "awarenav" / "models"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored, says the XDG standard
    assert default_folder() == Path.home() / ".cache" / "awarenav" / "models"
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "mine"))
    assert default_folder() == tmp_path / "mine"


# The catalogue and the command


@pytest.mark.parametrize("verb", [[], ["list"], ["verify"], ["fetch"]])
def test_help_says_what_a_verb_does(verb, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["models", *verb, "--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert "usage: awarenav models" in text
    assert not verb or "--out DIR" in text


def test_catalogue_fetches_nothing_that_binds_the_user():
    catalogue = Catalogue.shipped()
    assert {entry.licence for entry in catalogue.models} <= {"Apache-2.0", "MIT", "BSD-3-Clause"}
    assert all(entry.url.startswith("https://") for entry in catalogue.models)
    assert {"detector", "pose"} <= {entry.role for entry in catalogue.models}
    agpl = [entry for entry in catalogue.elsewhere if entry.licence == "AGPL-3.0"]
    assert agpl
    with pytest.raises(SimError, match=r"AGPL-3\.0.*not fetched"):
        catalogue["yolov8"]


@pytest.mark.skipif(not SHARED.is_dir(), reason="no genuine networks beside the checkout")
def test_catalogue_knows_the_genuine_detector():
    content = (SHARED / "rtmdet_nano_person_320_mmpose.onnx").read_bytes()
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
    """The command's catalogue, with one network on loopback."""
    server.serve("a.onnx", CONTENT)
    shipped = Catalogue.shipped()
    local = shipped.model_copy(
        update={"models": (model(server, "a.onnx", sha256=sha256(CONTENT), note="a test"),)}
    )
    monkeypatch.setattr(_store.Catalogue, "shipped", classmethod(lambda _: local))
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "models"))
    return local


def test_command_lists_fetches_and_verifies(catalogue, server, tmp_path, capsys):
    assert main(["models", "list"]) == 0
    listing = capsys.readouterr().out
    assert "made for the simulator" in listing
    assert server.url("a.onnx") in listing
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
    (tmp_path / "models" / "tiny.onnx").unlink()
    assert main(["models", "verify"]) == 1  # fetched once, and gone


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fetch", "tny"], "did you mean 'tiny'"),
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


def test_hash_that_is_none_is_refused(catalogue, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["models", "fetch", "tiny", "--sha256", "abc"])
    assert stop.value.code == 2
    assert "64 hexadecimal digits" in capsys.readouterr().err


def test_full_disk_is_said_before_anything_is_written(server, tmp_path, monkeypatch):
    server.serve("a.onnx", CONTENT)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1_000_000))
    with pytest.raises(SimError, match="1 MB free"):
        download(server.url("a.onnx"), tmp_path / "a.onnx", progress=False)
    assert names(tmp_path) == set()
