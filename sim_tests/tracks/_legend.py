"""What lines and marks of the picture mean."""

from __future__ import annotations

from typing import Any

from ._canvas import Axes, Figure, Line2D, Patch
from ._palette import CAMERA, FAINT, INK, PAPER, SHADE
from ._plan_view import STYLES


def draw_legends(
    figure: Figure, plan: Axes, gap: float, *, given: bool, truth: bool, field_of_view: bool
) -> None:
    """Explain the plan and the panels, to the right of the plan.

    Args:
        figure: to draw into.
        plan: the plan's axes.
        gap: between both, as a share of the figure's width.
        given: the identities come without a tracker.
        truth: there is truth beside them.
        field_of_view: the camera's is drawn.
    """

    def line(style: str, label: str) -> Line2D:
        width, dashes = STYLES[style]
        return Line2D([], [], color=INK, linewidth=width, linestyle=dashes, label=label)

    def mark(marker: str, label: str, **more: Any) -> Line2D:
        looks: dict[str, Any] = {"color": INK, "linestyle": "none", "markersize": 7, **more}
        return Line2D([], [], marker=marker, label=label, **looks)

    plan_marks: list[Line2D | Patch] = [
        *(
            [line("given", "person of the file")]
            if given
            else [
                line("confirmed", "confirmed"),
                line("tentative", "tentative"),
                line("coasting", "coasting (not seen)"),
            ]
        ),
        mark(">", "direction of time"),
        mark("o", "birth", markerfacecolor=PAPER),
        mark("x", "death", markeredgewidth=2.2),
        mark("o", "2σ of position", markerfacecolor="none", markersize=10, markeredgewidth=0.8),
        mark("s", "camera", color=CAMERA, markersize=5),
    ]
    if field_of_view:
        plan_marks.append(Patch(facecolor=CAMERA, alpha=0.2, label="its field of view"))
    awareness_marks: list[Line2D | Patch] = [
        Line2D([], [], color=INK, linewidth=2.2, label="lower bound, which counts"),
        Line2D([], [], color=INK, linewidth=0.9, label="α"),
        Patch(facecolor=INK, alpha=0.2, label="α ± 1 σ"),
        mark(".", "α of one frame", markersize=5, alpha=0.6),
        mark("|", "seen, no evidence", color=FAINT, markersize=6),
        Patch(facecolor=SHADE, label="not seen"),
    ]
    if given:
        awareness_marks = awareness_marks[3:]
    if truth:
        dotted: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (1.0, 1.6))}
        plan_marks.append(Line2D([], [], label="truth", **dotted))
        awareness_marks.append(Line2D([], [], label="true α", **dotted))
    box = plan.get_position()
    left = box.x1 + gap
    style: dict[str, Any] = {
        "frameon": False,
        "fontsize": 9.5,
        "title_fontsize": 10,
        "alignment": "left",
    }
    figure.legend(
        handles=plan_marks,
        title="From above",
        loc="upper left",
        bbox_to_anchor=(left, box.y1 + 0.01),
        **style,
    )
    figure.legend(
        handles=awareness_marks,
        title="Awareness over time",
        loc="lower left",
        bbox_to_anchor=(left, box.y0 - 0.02),
        **style,
    )
