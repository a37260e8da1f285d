from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from model_files import CONTENT, OTHER, model, names, sha256
from paths import SHARED

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.estimate import NetworkChoice
from awarenav.models import Catalogue, NetworkSet, download

MODELS = SHARED / "models"


@pytest.mark.parametrize("verb", [[], ["list"], ["verify"], ["fetch"]])
def test_help_says_what_a_models_command_does(verb, capsys):
    assert main(["models", *verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert "Usage: awarenav models" in text
    assert not verb or "--out DIR" in text


def test_catalogue_fetches_only_networks_with_permissive_licences():
    catalogue = Catalogue.shipped()
    assert {entry.licence for entry in catalogue.models} <= {"Apache-2.0", "MIT", "BSD-3-Clause"}
    assert all(entry.url.startswith("https://") for entry in catalogue.models)
    assert {"detector", "pose"} <= {entry.role for entry in catalogue.models}
    agpl = [entry for entry in catalogue.elsewhere if entry.licence == "AGPL-3.0"]
    assert agpl
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
    server.serve("a.onnx", CONTENT)
    shipped = Catalogue.shipped()
    server.serve("b.onnx", OTHER)
    networks = (
        model(server, "a.onnx", sha256=sha256(CONTENT), note="a test"),
        model(server, "b.onnx", name="small", role="pose", sha256=sha256(OTHER)),
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


def test_full_disk_is_reported_before_anything_is_written(server, tmp_path, monkeypatch):
    server.serve("a.onnx", CONTENT)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1_000_000))
    with pytest.raises(AwarenavError, match="1 MB free"):
        download(server.url("a.onnx"), tmp_path / "a.onnx", progress=False)
    assert names(tmp_path) == set()
