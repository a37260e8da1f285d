"""The work of ``awarenav policy explore``: one HTML page with sliders for every setting."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Final

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import RobotFile
from perception.anthropometry import BODY_RADIUS_M

from ..errors import AwarenavError
from ..files import write_text
from ._settings import policy_settings, robot_settings
from ._show import FOOTPRINT_M, read_policy
from ._situation import OVER_TIME, SITUATION

#: From the most to the least careful policy.
PRESETS: Final = ("blind", "conservative", "balanced", "assertive")
#: The scripts of the page in their order; the arithmetic comes first.
ARITHMETIC: Final = ("values", "separation", "adapter", "outline")
_SCRIPTS: Final = (*ARITHMETIC, "check", "yaml", "draw", "plan", "words", "controls", "page")
# That of the figures in docs/policies.md.
_ROBOT: Final = RobotFile(
    footprint_m=[list(corner) for corner in FOOTPRINT_M],
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExploreOptions:
    """The options of ``awarenav policy explore``."""

    policy: str
    robot: Path | None
    out: Path


def explore_command(options: ExploreOptions) -> int:
    """Run the command; return the exit status.

    Raises:
        AwarenavError: for an output file that cannot be written or would replace the input.
        NavError: for a policy or a robot file that cannot be used; nothing is written then.
    """
    policy = read_policy(options.policy)
    robot = _ROBOT if options.robot is None else RobotFile.from_yaml(options.robot)
    robot.profile()
    if options.out.suffix.lower() not in (".html", ".htm"):
        raise AwarenavError(f"--out must end in .html, got {options.out}")
    if options.out.is_dir():
        raise AwarenavError(f"--out must be a file, {options.out} is a folder")
    page = explorer_page(policy, robot, name=Path(options.policy).name)
    write_text(options.out, page)
    print(f"Written to {options.out}: open it in a browser")
    return 0


def explorer_page(policy: AwarenessPolicy, robot: RobotFile | None = None, *, name: str) -> str:
    """Return the policy explorer as one HTML page that needs no other file and no network.

    Args:
        policy: shown first; not with a custom object for radius or speed.
        robot: shown first; without one, a robot of 0.70 m × 0.50 m and 1.5 m/s.
        name: of the policy.

    Raises:
        AwarenavError: for a policy with a custom object.
    """
    data = {
        "body_radius_m": BODY_RADIUS_M,
        "models": policy_settings(),
        "over_time": OVER_TIME,
        "policy": {"name": name, "values": _values(policy)},
        "presets": {each: _values(AwarenessPolicy.preset(each)) for each in PRESETS},
        "robot": (robot or _ROBOT).model_dump(mode="json", exclude={"camera", "scanners"}),
        "robot_fields": robot_settings(),
        "situation": SITUATION,
    }
    script = f"const DATA = {_script_json(data)};\n"
    script += "\n".join(_template(f"{part}.js") for part in _SCRIPTS)
    page = _template("explorer.html")
    # Each part occurs once in the template; the style and the script contain no such name.
    for part, text in (("style", _template("explorer.css")), ("script", script)):
        before, after = page.split(f"<!-- {part} -->")
        page = before + text + after
    return page


def _values(policy: AwarenessPolicy) -> dict[str, Any]:
    try:
        values = policy.model_dump(mode="json")
        json.dumps(values)
    except (TypeError, ValueError) as cause:
        raise AwarenavError(
            "the explorer shows policies that can be written to YAML, got one with an object of "
            "its own for inflation or speed"
        ) from cause
    return values


def _script_json(value: Any) -> str:
    """Return JSON that may stand in a script: no text in it can end the script."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for letter in "<>\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text


def _template(name: str) -> str:
    return (resources.files("awarenav.policies") / "templates" / name).read_text("utf-8")
