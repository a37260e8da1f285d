import av
import numpy as np
import pytest

from awarenav.errors import AwarenavError
from awarenav.video import VideoWriter


def test_a_video_has_its_images_at_its_rate(tmp_path):
    path = tmp_path / "film.mp4"
    greys = [20, 120, 220] * 5
    with VideoWriter(path, 15, (64, 48)) as video:
        for grey in greys:
            video.add(np.full((48, 64, 3), grey, np.uint8))
        assert not path.exists()
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.average_rate == 15
        shown = [frame.to_ndarray(format="gray").mean() for frame in film.decode(stream)]
    assert shown == pytest.approx(greys, abs=12)


def test_an_interrupted_video_keeps_what_was_filmed(tmp_path):
    path = tmp_path / "film.mp4"

    def film():
        with VideoWriter(path, 15, (64, 48)) as video:
            video.add(np.zeros((48, 64, 3), np.uint8))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film()
    with av.open(str(path)) as film:
        assert len(list(film.decode(video=0))) == 1


def test_sizes_that_cannot_be_encoded_are_refused(tmp_path):
    with pytest.raises(AwarenavError, match="even"):
        VideoWriter(tmp_path / "a.mp4", 15, (63, 48))
    with VideoWriter(tmp_path / "b.mp4", 15, (64, 48)) as video:
        with pytest.raises(AwarenavError, match="shape"):
            video.add(np.zeros((10, 10, 3), np.uint8))
        video.add(np.zeros((48, 64, 3), np.uint8))
