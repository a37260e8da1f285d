"""Findings about an installation and a camera: ``awarenav doctor``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._findings import Finding, by_importance
    from ._installation import installation_findings
    from ._pictures import PictureFigures, picture_figures, picture_findings
    from ._run import DoctorOptions, doctor_command

__all__ = [
    "DoctorOptions",
    "Finding",
    "PictureFigures",
    "by_importance",
    "doctor_command",
    "installation_findings",
    "picture_figures",
    "picture_findings",
]

__getattr__ = lazy_page(__name__, __file__)
