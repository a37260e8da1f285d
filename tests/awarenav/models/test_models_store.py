from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import filelock
import pytest
from model_files import CONTENT, OTHER, model, names, sha256, store, zipped
from paths import SHARED

from awarenav.errors import AwarenavError
from awarenav.models import default_folder

MODELS = SHARED / "models"


def test_pinned_network_is_fetched_once_and_verified(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(AwarenavError, match="awarenav models fetch tiny"):
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
    with pytest.raises(AwarenavError, match="not a complete ZIP archive"):
        store(tmp_path, entry).fetch("tiny", progress=False)
    assert names(tmp_path) == set()


def test_download_with_a_wrong_sha256_is_dropped_and_the_old_file_stays(server, tmp_path):
    server.serve("a.onnx", OTHER)
    (tmp_path / "tiny.onnx").write_bytes(b"what was there")
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(AwarenavError) as refused:
        fetched.fetch("tiny", progress=False)
    assert sha256(OTHER) in str(refused.value)
    assert sha256(CONTENT) in str(refused.value)
    assert (tmp_path / "tiny.onnx").read_bytes() == b"what was there"
    assert names(tmp_path) == {"tiny.onnx"}
    with pytest.raises(AwarenavError, match="altered"):
        fetched.path("tiny")


def test_altered_network_is_noticed_and_replaced(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    path, _ = fetched.fetch("tiny", progress=False)
    path.write_bytes(CONTENT[:-1])
    with pytest.raises(AwarenavError, match=f"{sha256(CONTENT[:-1])}, expected {sha256(CONTENT)}"):
        fetched.path("tiny")
    assert fetched.fetch("tiny", progress=False) == (path, True)
    assert fetched.path("tiny") == path


def test_login_page_is_not_trusted_on_first_use(server, tmp_path):
    server.serve("a.onnx", b"<html>please log in</html>")
    fetched = store(tmp_path, model(server, "a.onnx"))
    with pytest.raises(AwarenavError, match="is not a network"):
        fetched.fetch("tiny", progress=False)
    assert fetched.locked() == {}
    assert names(tmp_path) == set()


@pytest.mark.skipif(not MODELS.is_dir(), reason="no genuine networks beside the checkout")
def test_first_fetch_is_trusted_and_later_ones_must_match_it(server, tmp_path):
    first = (MODELS / "yolox_nano_416_coco.onnx").read_bytes()
    second = (MODELS / "rtmdet_nano_person_320_mmpose.onnx").read_bytes()
    server.serve("a.onnx", first)
    fetched = store(tmp_path, model(server, "a.onnx"))
    path, _ = fetched.fetch("tiny", progress=False)
    assert fetched.locked()["tiny"].sha256 == sha256(first)
    assert not fetched.locked()["tiny"].pinned
    assert fetched.load("tiny").inputs[0].shape == (1, 3, 416, 416)
    path.write_bytes(second)
    with pytest.raises(AwarenavError, match="altered"):
        fetched.load("tiny")
    path.unlink()
    server.serve("a.onnx", second, etag='"2"')
    with pytest.raises(AwarenavError, match=f"{sha256(second)}, expected {sha256(first)}"):
        fetched.fetch("tiny", progress=False)
    with pytest.raises(AwarenavError, match="the first fetch says"):
        fetched.fetch("tiny", sha256=sha256(second), progress=False)


def test_download_must_have_the_sha256_of_the_user(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx"))
    with pytest.raises(AwarenavError, match="expected"):
        fetched.fetch("tiny", sha256=sha256(OTHER), progress=False)
    fetched.fetch("tiny", sha256=sha256(CONTENT), progress=False)
    assert fetched.locked()["tiny"].pinned
    pinned = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with pytest.raises(AwarenavError, match="the catalogue says"):
        pinned.fetch("tiny", sha256=sha256(OTHER), progress=False)


def test_file_that_was_not_fetched_is_refused(server, tmp_path):
    (tmp_path / "tiny.onnx").write_bytes(CONTENT)
    with pytest.raises(AwarenavError, match="not put there"):
        store(tmp_path, model(server, "a.onnx")).path("tiny")


@pytest.mark.parametrize("text", ["{", "[]", '{"models": {"tiny": {}}}', '{"models": 3}'])
def test_damaged_lock_file_is_refused(server, tmp_path, text):
    (tmp_path / "models.lock.json").write_text(text)
    server.serve("a.onnx", CONTENT)
    with pytest.raises(AwarenavError, match=r"models\.lock\.json cannot be read"):
        store(tmp_path, model(server, "a.onnx")).fetch("tiny", progress=False)
    assert server.requests == []


def test_two_fetches_of_one_network_at_once_are_refused(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    with (
        filelock.FileLock(tmp_path / ".tiny.lock"),
        pytest.raises(AwarenavError, match=r"tiny is being fetched to .* already"),
    ):
        fetched.fetch("tiny", progress=False)
    assert server.requests == []
    assert fetched.fetch("tiny", progress=False)[1]


HOLD_LOCK = """
import sys, time
import filelock
with filelock.FileLock(sys.argv[1]):
    print("held", flush=True)
    time.sleep(600.0)
"""


def test_a_fetch_that_was_killed_leaves_no_lock_behind(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    command = [sys.executable, "-c", HOLD_LOCK, str(tmp_path / ".tiny.lock")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(AwarenavError, match="being fetched"):
            fetched.fetch("tiny", progress=False)
        holder.kill()
    assert fetched.fetch("tiny", progress=False)[1]


def test_fetches_of_two_networks_wait_for_each_other_to_write_the_lock_file(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    fetched = store(tmp_path, model(server, "a.onnx", sha256=sha256(CONTENT)))
    done = threading.Event()

    def fetch():
        fetched.fetch("tiny", progress=False)
        done.set()

    other = filelock.FileLock(tmp_path / ".lock")
    with other:
        thread = threading.Thread(target=fetch)
        thread.start()
        assert not done.wait(0.3)
        assert fetched.locked() == {}
    thread.join(30.0)
    assert done.is_set()
    assert set(fetched.locked()) == {"tiny"}


def test_a_folder_that_cannot_be_written_is_named(server, tmp_path):
    (tmp_path / ".tiny.lock").mkdir()
    with pytest.raises(AwarenavError, match=f"cannot write to {tmp_path}"):
        store(tmp_path, model(server, "a.onnx")).fetch("tiny", progress=False)


def test_folder_that_cannot_be_made(server, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(AwarenavError, match="cannot make"):
        store(tmp_path / "file" / "models", model(server, "a.onnx")).fetch("tiny")


def test_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("AWARENAV_MODELS", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_folder() == tmp_path / "awarenav" / "models"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored, says the XDG standard
    assert default_folder() == Path.home() / ".cache" / "awarenav" / "models"
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "mine"))
    assert default_folder() == tmp_path / "mine"
