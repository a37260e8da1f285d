"""A crossing as a page to watch in a browser: states, camera pictures, recorded and live pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._live import LivePage
    from ._page import page_text, show_page, write_page
    from ._pictures import CameraPictures
    from ._recorder import CrossingRecorder
    from ._states import begin_of, outcome_text, state_of

__all__ = [
    "CameraPictures",
    "CrossingRecorder",
    "LivePage",
    "begin_of",
    "outcome_text",
    "page_text",
    "show_page",
    "state_of",
    "write_page",
]

__getattr__ = lazy_page(__name__, __file__)
