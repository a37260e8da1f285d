from __future__ import annotations

import http.client
import io
import json
import urllib.request

import pytest
from model_files import CONTENT, OTHER, names, zipped
from model_server import ModelServer

from awarenav.errors import AwarenavError
from awarenav.models import BrokenDownloadError, download, extract_member
from awarenav.models._connection import _AllowedRedirects


def test_download_appears_whole(server, tmp_path):
    server.serve("a.onnx", CONTENT)
    download(server.url("a.onnx"), tmp_path / "a.onnx", progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert names(tmp_path) == {"a.onnx"}


def test_download_continues_where_it_broke_off(server, tmp_path):
    server.serve("a.onnx", CONTENT, cuts=[300_000, 400_000, None])
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert [request.get("range") for request in server.requests] == [
        None,
        "bytes=300000-",
        "bytes=700000-",
    ]
    assert {request.get("if-range") for request in server.requests[1:]} == {'"1"'}


def test_next_call_continues_a_broken_download(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT, cuts=[500_000])
    with pytest.raises(BrokenDownloadError, match=r"after 500000 bytes.*run it again"):
        download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert not target.exists()
    download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert target.read_bytes() == CONTENT
    assert server.requests[-1]["range"] == "bytes=500000-"


@pytest.mark.parametrize("etag", [None, 'W/"1"'])
def test_date_replaces_a_missing_strong_tag(server, tmp_path, etag):
    server.serve("a.onnx", CONTENT, etag=etag, cuts=[500_000])
    server.files["a.onnx"].etag = None  # then the server compares the date
    download(server.url("a.onnx"), tmp_path / "a.onnx", pause_s=0.0, progress=False)
    assert (tmp_path / "a.onnx").read_bytes() == CONTENT
    assert server.requests[-1]["if-range"].startswith("Thu, 01 Jan 1970")


def test_parts_of_two_files_are_never_joined(server, tmp_path):
    target = tmp_path / "a.onnx"
    server.serve("a.onnx", CONTENT, cuts=[500_000])
    with pytest.raises(BrokenDownloadError):
        download(server.url("a.onnx"), target, attempts=1, progress=False)
    server.serve("a.onnx", OTHER, etag='"2"')
    download(server.url("a.onnx"), target, attempts=1, progress=False)
    assert target.read_bytes() == OTHER


def test_part_from_another_address_is_not_continued(server, tmp_path):
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
def test_damaged_state_means_a_download_from_the_beginning(server, tmp_path, note):
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
    with pytest.raises(AwarenavError, match="404"):
        download(server.url("gone.onnx"), tmp_path / "gone.onnx", progress=False)
    assert len(server.requests) == 1
    assert names(tmp_path) == {"a.onnx"}


def test_address_without_a_server(tmp_path):
    with ModelServer() as closed:
        url = closed.url("a.onnx")
    with pytest.raises(AwarenavError, match="no connection"):
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
    follow = _AllowedRedirects().redirect_request
    arguments = (request, io.BytesIO(), 302, "Found", http.client.HTTPMessage())
    with pytest.raises(AwarenavError, match="not encrypted"):
        follow(*arguments, "http://elsewhere/a.onnx")
    assert follow(*arguments, "https://elsewhere/a.onnx").full_url == "https://elsewhere/a.onnx"


def test_member_is_found_in_any_folder_and_written_to_the_target(tmp_path):
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
    with pytest.raises(AwarenavError, match=message):
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
    with pytest.raises(AwarenavError, match="not a complete ZIP archive"):
        extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")


def test_damaged_entry_is_refused(tmp_path):
    whole = bytearray(zipped(**{"end2end.onnx": CONTENT}))
    whole[len(whole) // 2] ^= 0xFF
    archive = tmp_path / "a.zip"
    archive.write_bytes(whole)
    with pytest.raises(AwarenavError, match="not a complete ZIP archive"):
        extract_member(archive, "end2end.onnx", tmp_path / "out.onnx")
