"""A crossing as a page to watch in a browser: states, camera pictures, recorded and live pages."""

from __future__ import annotations

from ._page import LivePage, page_text, show_page, write_page
from ._recorder import CameraPictures, CrossingRecorder, begin_of, outcome_text, state_of
