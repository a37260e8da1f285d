"""Findings of ``awarenav doctor`` on installations and cameras with one thing wrong at a time."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import SHARED

from awarenav.cli import main
from awarenav.doctor._findings import Finding, by_importance
from awarenav.doctor._pictures import picture_figures
from awarenav.models import ModelStore
from perception import _manifest
from perception.shipped import shipped_models

PHOTOGRAPHS = SHARED / "images"
RNG = np.random.default_rng(0)
# Edges of all directions and contrasts.
SCENE = cv2.resize(RNG.integers(20, 230, (24, 32, 3), np.uint8), (640, 480), interpolation=0)


@pytest.fixture(scope="module")
def renders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("renders")
    assert main(["render", "--frames", "4", "--scenes", "1", "--out", str(folder)]) == 0
    return folder


def findings(*arguments: object) -> dict[str, list[Finding]]:
    """The findings by subject; the exit status must fit them."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        status = main(["doctor", *map(str, arguments), "--json"])
    found = [Finding(**each) for each in json.loads(out.getvalue())]
    assert found == by_importance(found)
    assert status == int(any(each.severity == "error" for each in found))
    by_subject: dict[str, list[Finding]] = {}
    for each in found:
        by_subject.setdefault(each.subject, []).append(each)
    return by_subject


def severities(found: dict[str, list[Finding]], subject: str) -> set[str]:
    return {each.severity for each in found.get(subject, ())}


def test_an_installation_without_a_camera(tmp_path, monkeypatch):
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path))
    found = findings()
    assert severities(found, "packages") <= {"fine", "warning"}
    assert severities(found, "shipped networks") == {"fine"}
    assert found["fetched networks"][0].remedy == "awarenav models fetch real"
    assert "networks" not in found


def test_altered_networks_are_errors(tmp_path, monkeypatch):
    folder = Path(shutil.copytree(_manifest._FOLDER, tmp_path / "models"))
    (folder / shipped_models()[0].file).write_bytes(b"other")
    monkeypatch.setattr(_manifest, "_FOLDER", folder)
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path / "fetched"))
    (tmp_path / "fetched").mkdir()
    (tmp_path / "fetched" / "yolox-nano.onnx").write_bytes(b"other")
    assert ModelStore().is_fetched("yolox-nano")
    found = findings()
    assert severities(found, "shipped networks") == {"error"}
    assert severities(found, "fetched networks") == {"error"}
    assert "yolox-nano" in found["fetched networks"][0].remedy


def test_a_set_of_renders_has_no_errors_and_a_test_picture(renders, tmp_path):
    picture = tmp_path / "new" / "seen.png"
    found = findings(renders, "--out", picture)
    for subject in ("networks", "calibration", "exposure", "sharpness", "people"):
        assert severities(found, subject) == {"fine"}, subject
    assert "the images are renders" in found["networks"][0].text
    drawn = cv2.imread(str(picture))
    assert drawn.shape == (480, 640, 3)
    assert min(int(np.abs(drawn.astype(int) - each).max()) for each in images(renders)) > 50


def images(folder: Path) -> list[np.ndarray]:
    return [cv2.imread(str(path)) for path in sorted(folder.glob("0*.png"))]


def copied(renders: Path, folder: Path, change) -> Path:
    """A folder of changed images without any file beside them."""
    folder.mkdir()
    for number, image in enumerate(images(renders)):
        assert cv2.imwrite(str(folder / f"{number}.png"), change(image))
    return folder


@pytest.fixture(scope="module")
def plain(renders, tmp_path_factory) -> dict[str, list[Finding]]:
    """The findings about the images alone."""
    folder = copied(renders, tmp_path_factory.mktemp("plain") / "set", lambda image: image)
    return findings(folder, "--out", "none", "--fov-deg", 60)


@pytest.mark.parametrize(
    ("change", "subject", "severity"),
    [
        (lambda image: cv2.GaussianBlur(image, (0, 0), 4.0), "sharpness", "warning"),
        (lambda image: np.minimum(image.astype(int) * 4 + 60, 255), "exposure", "warning"),
        (lambda image: np.maximum(image.astype(int) - 85, 0), "exposure", "warning"),
        (lambda image: np.full_like(image, 90), "images", "error"),
    ],
    ids=["blurred", "burnt out", "dark", "lens cap"],
)
def test_pictures_of_a_bad_camera(renders, tmp_path, change, subject, severity):
    folder = copied(renders, tmp_path / "set", change)
    found = findings(folder, "--out", "none", "--fov-deg", 60)
    assert severities(found, subject) == {severity}
    assert severities(found, "networks") == {"error"}
    assert severities(found, "calibration") == {"warning"}


def test_people_who_are_blurred_by_motion_need_a_shorter_exposure(renders, plain, tmp_path):
    """The edges of a picture stay sharp across the motion, so the sharpness is fine."""
    assert severities(plain, "people") == {"fine"}
    blurred = copied(renders, tmp_path / "blurred", lambda image: cv2.blur(image, (1, 25)))
    found = findings(blurred, "--out", "none", "--fov-deg", 60)
    assert severities(found, "people") == {"fine", "warning"}
    (told,) = (each for each in found["people"] if each.severity == "warning")
    assert "heads show no direction" in told.text
    assert "shorter exposure" in told.remedy
    (counts,) = (each for each in found["people"] if each.severity == "fine")
    assert "head direction unknown: " in counts.text


def test_a_camera_that_is_frozen(renders, tmp_path):
    folder = copied(renders, tmp_path / "set", lambda image: image)
    first = (folder / "0.png").read_bytes()
    for path in folder.glob("*.png"):
        path.write_bytes(first)
    (folder / "3.png").write_bytes(b"damaged")
    found = findings(folder, "--out", "none")
    assert severities(found, "images") == {"error", "warning"}
    assert "frozen" in found["images"][0].text
    # Without a calibration distances are wrong. In the order of importance, what sees the wrong
    # thing comes before what measures it wrongly.
    assert severities(found, "calibration") == {"error"}
    assert next(iter(found)) == "networks"


@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="no photographs beside the checkout")
def test_photographs_need_other_networks(tmp_path):
    detector = SHARED / "models" / "rtmdet_nano_person_320_mmpose.onnx"
    picture = tmp_path / "seen.png"
    found = findings(PHOTOGRAPHS, "--out", picture, "--frames", 4)
    assert severities(found, "networks") == {"error"}
    assert "detector, pose and head" in found["networks"][0].text
    assert picture.exists()
    found = findings(PHOTOGRAPHS, "--out", "none", "--frames", 2, "--detector", detector)
    assert "the pose and head networks" in found["networks"][0].text


@pytest.mark.skipif(not (SHARED / "models").is_dir(), reason="no networks beside the checkout")
def test_a_catalogued_network_is_known_whatever_its_file_is_called(renders):
    detector = f"rtmdet:{SHARED / 'models' / 'rtmdet_nano_person_320_mmpose.onnx'}"
    options = ["--out", "none", "--frames", 1, "--threads", 1]
    found = findings(renders, *options, "--detector", detector)
    assert severities(found, "networks") == {"fine"}
    # The first images warm up caches and networks: nothing follows from their time.
    assert "frame rate" not in found
    assert (
        "detector photographs, rtmdet-nano by OpenMMLab; pose renders" in found["networks"][0].text
    )
    unknown = SHARED / "models" / "yolov8n_int8_640_coco.onnx"
    found = findings(renders, *options, "--detector", unknown)
    assert severities(found, "networks") == {"warning"}
    assert "detector not known; pose renders" in found["networks"][0].text


# --- figures ------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=20)
@given(st.floats(1.0, 6.0), st.floats(0.3, 1.0))
def test_the_width_of_edges_grows_with_blur_and_not_with_contrast(sigma_px, contrast):
    faint = (SCENE * contrast).astype(np.uint8)
    sharp, blurred, more = (
        picture_figures(cv2.GaussianBlur(faint, (0, 0), each) if each else faint).edge_px
        for each in (0.0, sigma_px, 1.5 * sigma_px)
    )
    assert sharp < 3.0
    assert sharp < blurred < more
    full = picture_figures(cv2.GaussianBlur(SCENE, (0, 0), sigma_px)).edge_px
    assert blurred == pytest.approx(full, rel=0.15)


@pytest.mark.parametrize(
    ("quarters", "roll_deg"), [(1, 90), (2, 180), (3, -90)], ids=["right", "upside down", "left"]
)
def test_a_camera_that_is_rolled_is_told_by_the_people_it_shows(
    renders, plain, tmp_path, quarters, roll_deg
):
    """Of pictures turned counter-clockwise, the camera was rolled clockwise."""
    folder = copied(renders, tmp_path / "set", lambda image: np.rot90(image, quarters))
    found = findings(folder, "--out", "none", "--fov-deg", 60)
    assert severities(found, "mount") == {"error"}
    assert f"roll_deg: {roll_deg} " in found["mount"][0].remedy
    assert "mount" not in plain
