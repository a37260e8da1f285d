"""Networks out of wheels, npm packages and files of one's own, with the genuine pip and npm."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import shutil
import stat
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest
from model_files import entry, names, sha256, store_of, zipped

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.models import ModelStore, _sources
from perception.named import Catalogue, RealModel

# Not networks, but their sha256 tells them apart as it does networks.
BOXES, POINTS, OTHER = b"boxes" * 1000, b"points" * 1000, b"others" * 1000
WHEEL = "fake_nets-1.0-py3-none-any.whl"


def wheel(path: Path, version: str = "1.0", boxes: bytes = BOXES) -> Path:
    """Write a wheel with a network, and with another one in a bundle."""
    info = f"fake_nets-{version}.dist-info"
    files = {
        "fake_nets/__init__.py": b"raise SystemExit('nobody imports it')",
        "fake_nets/models/boxes.tflite": boxes,
        "fake_nets/models/pose.task": zipped({"points.tflite": POINTS}),
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: fake-nets\nVersion: {version}\n"
        "Requires-Dist: nothing-that-exists\n".encode(),
        f"{info}/WHEEL": b"Wheel-Version: 1.0\nGenerator: t\nRoot-Is-Purelib: true\n"
        b"Tag: py3-none-any\n",
    }
    record = "".join(
        f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode()},\n"
        for name, content in files.items()
    )
    path.write_bytes(zipped({**files, f"{info}/RECORD": record.encode()}))
    return path


def tgz(path: Path, files: dict[str, bytes]) -> Path:
    with tarfile.open(path, "w:gz") as archive:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return path


PIP_BOXES = {"wheel": "fake-nets==1.0", "member": "fake_nets/models/boxes.tflite"}
PIP_POINTS = {"wheel": "fake-nets==1.0", "member": ["fake_nets/models/pose.task", "points.tflite"]}
GONE = {"url": "http://127.0.0.1:9/published_boxes.tflite"}
NETWORKS = (entry("boxes", BOXES, PIP_BOXES, GONE), entry("points", POINTS, PIP_POINTS))


def store(folder: Path, *networks: RealModel) -> ModelStore:
    return store_of(folder, *(networks or NETWORKS))


@pytest.fixture
def index(tmp_path, monkeypatch):
    """A folder of wheels, all that pip knows of."""
    folder = tmp_path / "index"
    folder.mkdir()
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setattr(_sources, "_RETRIES", 0)
    return folder


def refusal(nets: ModelStore, *wanted: str, origin: Path | None = None) -> str:
    """Return the one line of a failed fetch, which leaves the folder as it was."""
    before = names(nets.folder)
    with pytest.raises(AwarenavError) as raised:
        nets.fetch(*wanted, origin=origin, progress=False)
    assert "\n" not in str(raised.value)
    assert names(nets.folder) == before
    return str(raised.value)


@pytest.mark.slow
def test_the_users_pip_brings_a_wheel_once_and_takes_nothing_else(index, tmp_path, capfd):
    wheel(index / WHEEL)
    nets = store(tmp_path / "nets")
    fetched = nets.fetch("boxes", "points")
    assert [path.read_bytes() for path, _ in fetched.values()] == [BOXES, POINTS]
    assert {source for _, source in fetched.values()} == {"fake-nets==1.0"}
    assert names(nets.folder) == {"boxes.tflite", "points.tflite"}
    streams = capfd.readouterr()
    assert streams.out == ""
    assert streams.err.count("pip download --no-deps fake-nets==1.0") == 1


@pytest.mark.slow
def test_what_pip_cannot_give_is_one_line(index, tmp_path, monkeypatch):
    nets = store(tmp_path / "nets")
    told = refusal(nets, "boxes")
    assert "`pip download --no-deps fake-nets==1.0` fails with status 1" in told
    assert "no connection to 127.0.0.1" in told  # of the next source
    assert "what else works: --from" in told
    # Cut off: pip itself refuses half of a wheel.
    (index / WHEEL).write_bytes(wheel(index / WHEEL).read_bytes()[:-500])
    assert "fails with status" in refusal(nets, "points")
    wheel(index / WHEEL, boxes=OTHER)
    assert f"has sha256 {sha256(OTHER)}, expected {sha256(BOXES)}" in refusal(nets, "boxes")
    monkeypatch.setenv("PIP_FIND_LINKS", "")
    monkeypatch.delenv("PIP_NO_INDEX")
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("PIP_RETRIES", "1")
    assert "no connection to the index: [Errno" in refusal(nets, "points")


def test_without_pip_the_command_to_run_by_hand_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(_sources, "find_spec", lambda _: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    told = refusal(store(tmp_path / "nets"), "points")
    assert "there is no pip in this environment for `pip download --no-deps fake-nets==1.0`" in told
    assert "--from" in told


def npm_entries() -> tuple[RealModel, ...]:
    npm = {"npm": "@fake/nets@1.0.0", "member": "models/a.onnx"}
    parts = [
        {"member": "models/graph.json", "sha256": sha256(BOXES)},
        {"member": "models/graph.bin", "sha256": sha256(POINTS)},
    ]
    made = POINTS + BOXES
    return (
        entry("plain", OTHER, npm),
        entry("made", made, {"npm": "@fake/nets@1.0.0"}, converted_from=parts),
    )


NPM_FILES = {
    "models/a.onnx": OTHER,
    "models/graph.json": BOXES,
    "models/graph.bin": POINTS,
    "package.json": json.dumps(
        {"name": "@fake/nets", "version": "1.0.0", "scripts": {"prepack": "touch ran"}}
    ).encode(),
}


@pytest.fixture
def converter(monkeypatch):
    """In place of MoveNet's conversion, one that joins the two files."""
    monkeypatch.setattr(_sources, "movenet_onnx", lambda graph, weights: weights + graph)
    monkeypatch.setattr(_sources, "find_spec", lambda _: True)


@pytest.fixture
def npm(tmp_path, monkeypatch):
    """An npm that packs a local folder, as the genuine one does, or fails as ``NPM_FAILS`` says."""
    folder = tmp_path / "bin"
    folder.mkdir()
    package = tgz(
        tmp_path / "served.tgz", {f"package/{name}": file for name, file in NPM_FILES.items()}
    )
    program = folder / "npm"
    program.write_text(
        "#!/bin/sh\n"
        f'echo "$@" >> {tmp_path}/calls\n'
        'if [ "$NPM_FAILS" ]; then echo "$NPM_FAILS" >&2; exit 7; fi\n'
        'while [ "$1" != --pack-destination ]; do shift; done\n'
        f'cp {package} "$2/fake-nets-1.0.0.tgz"\n'
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    return tmp_path / "calls"


def test_npm_brings_a_package_once_and_its_parts_are_converted(npm, converter, tmp_path):
    nets = store(tmp_path / "nets", *npm_entries())
    fetched = nets.fetch("plain", "made", progress=False)
    assert [path.read_bytes() for path, _ in fetched.values()] == [OTHER, POINTS + BOXES]
    assert names(nets.folder) == {"plain.onnx", "made.onnx"}
    (call,) = npm.read_text().splitlines()
    assert call.startswith("pack --ignore-scripts ")
    assert call.endswith(" @fake/nets@1.0.0")


def test_a_conversion_with_another_result_is_not_kept(npm, converter, tmp_path, monkeypatch):
    monkeypatch.setattr(_sources, "movenet_onnx", lambda graph, weights: graph)
    told = refusal(store(tmp_path / "nets", *npm_entries()), "made")
    assert f"made.onnx has sha256 {sha256(BOXES)}" in told


def test_npm_that_is_missing_or_fails_is_one_line(npm, converter, tmp_path, monkeypatch):
    nets = store(tmp_path / "nets", *npm_entries())
    monkeypatch.setenv(
        "NPM_FAILS",
        "npm error code ENOTFOUND\nnpm error errno ENOTFOUND\nnpm error FetchError: no such host",
    )
    told = refusal(nets, "plain", "made")
    assert "`npm pack @fake/nets@1.0.0` fails with status 7 (FetchError: no such host)" in told
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    told = refusal(nets, "made")
    assert "there is no npm in this environment for `npm pack @fake/nets@1.0.0`" in told


@pytest.mark.slow
def test_genuine_npm_packs_what_is_read(converter, tmp_path):
    """The layout of the archive is npm's own, and no script of the package runs."""
    if shutil.which("npm") is None:
        pytest.skip("there is no npm")
    package = tmp_path / "package"
    for name, content in NPM_FILES.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    subprocess.run(
        ["npm", "pack", "--ignore-scripts", "--offline", f"--pack-destination={tmp_path}", package],
        check=True,
        capture_output=True,
    )
    nets = store(tmp_path / "nets", *npm_entries())
    fetched = nets.fetch("plain", "made", origin=tmp_path / "fake-nets-1.0.0.tgz", progress=False)
    assert [path.read_bytes() for path, _ in fetched.values()] == [OTHER, POINTS + BOXES]
    assert not (package / "ran").exists()


def unpacked(path: Path) -> Path:
    """Unpack a wheel beside it, and the bundle in it."""
    folder = path.with_suffix("")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    with zipfile.ZipFile(folder / "fake_nets/models/pose.task") as archive:
        archive.extractall(folder / "fake_nets/models/flat")
    return folder


def test_from_takes_networks_packages_bundles_and_folders_of_them(tmp_path, monkeypatch):
    monkeypatch.setattr(_sources.Sources, "fetch", None)  # no connection
    made = wheel(tmp_path / WHEEL)
    folder = unpacked(made)
    models = folder / "fake_nets" / "models"
    newer = tmp_path / "newer"
    newer.mkdir()
    # A version with the same networks; a broken download beside it does not matter.
    wheel(newer / "fake_nets-2.0-py3-none-any.whl", version="2.0")
    (newer / "boxes.tflite").write_bytes(BOXES[:99])
    published = tmp_path / "published"
    published.mkdir()
    (published / "published_boxes.tflite").write_bytes(BOXES)
    renamed = tmp_path / "anything.tflite"
    renamed.write_bytes(BOXES)
    both = ("boxes", "points")
    for number, (origin, wanted) in enumerate(
        [
            (made, both),
            (tmp_path, both),
            (folder, both),
            (models, both),
            (newer, both),
            (models / "pose.task", ("points",)),
            (models / "flat", ("points",)),
            (published, ("boxes",)),
            (renamed, ("boxes",)),
        ]
    ):
        nets = store(tmp_path / f"nets{number}")
        fetched = nets.fetch(*wanted, origin=origin, progress=False)
        for name, (path, source) in fetched.items():
            assert path.read_bytes() == {"boxes": BOXES, "points": POINTS}[name]
            assert str(origin) in source
    assert renamed.read_bytes() == BOXES


def test_from_without_the_network_is_one_line_and_nothing_is_lost(tmp_path):
    nets = store(tmp_path / "nets")
    nets.folder.mkdir()
    old = nets.folder / "boxes.tflite"
    old.write_bytes(b"an old one")
    empty = tmp_path / "empty"
    empty.mkdir()
    told = refusal(nets, "boxes", origin=empty)
    assert "looked for boxes.tflite, fake_nets-*.whl, published_boxes.tflite" in told
    assert "there is no" in refusal(nets, "boxes", origin=tmp_path / "nowhere")
    other = wheel(tmp_path / "fake_nets-2.0-py3-none-any.whl", version="2.0", boxes=OTHER)
    for origin in (other, tmp_path):
        told = refusal(nets, "boxes", origin=origin)
        assert "fake_nets/models/boxes.tflite in fake_nets-2.0-py3-none-any.whl has sha256" in told
        assert f"{sha256(OTHER)}, expected {sha256(BOXES)}" in told
    half = tmp_path / WHEEL
    half.write_bytes(other.read_bytes()[:3000])
    assert f"{WHEEL} is not a complete archive" in refusal(nets, "boxes", origin=half)
    assert "looked for" in refusal(nets, "boxes", origin=Path(__file__))
    assert old.read_bytes() == b"an old one"


def test_names_in_an_npm_package_never_become_paths(converter, tmp_path):
    evil = tgz(tmp_path / "fake-nets-9.tgz", {"../../models/a.onnx": OTHER, "/etc/x": b""})
    nets = store(tmp_path / "deep" / "nets", *npm_entries())
    path, _ = nets.fetch("plain", origin=evil, progress=False)["plain"]
    assert path.read_bytes() == OTHER
    assert names(tmp_path) == {"deep", evil.name}
    cut = tmp_path / "fake-nets-9.tgz"
    cut.write_bytes(evil.read_bytes()[:60])
    assert "is not a complete archive" in refusal(nets, "made", origin=cut)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    told = refusal(store(tmp_path / "file" / "nets"), "boxes", origin=wheel(tmp_path / WHEEL))
    assert "cannot write to" in told


def test_the_command_takes_a_set_from_a_folder(tmp_path, monkeypatch, capsys):
    shipped = Catalogue.shipped().model_copy(
        update={
            "models": (NETWORKS[0], entry("points", POINTS, PIP_POINTS, role="pose")),
            "sets": (),
        }
    )
    monkeypatch.setattr(Catalogue, "shipped", classmethod(lambda _: shipped))
    monkeypatch.chdir(tmp_path)
    wheel(tmp_path / WHEEL)
    assert main(["models", "fetch", "boxes", "points", "--from", ".", "--out", "nets"]) == 0
    assert f"from {WHEEL}" in capsys.readouterr().out
    assert main(["models", "fetch", "boxes", "--from", "gone", "--out", "new"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
