"""Variants: the combinations of policy, planner, perception and fault that a run compares."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from ._record import EpisodeRecord

_NO_FAULT: Final = "no fault"


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination of what a run compares.

    Attributes:
        policy: name of the policy.
        planner: name of the planner.
        perception: ``"truth"``, ``"keypoints"``, ``"pixels"`` or ``"oracle"``.
        fault: name of the fault, empty for none.
        source: name of the table that its episodes come from, empty with a single table.
    """

    policy: str
    planner: str = ""
    perception: str = ""
    fault: str = ""
    source: str = ""

    @classmethod
    def of(cls, record: EpisodeRecord, source: str = "") -> Variant:
        """Return the variant of an episode."""
        return cls(record.policy, record.planner, record.perception, record.fault, source)


def labels(variants: Iterable[Variant]) -> dict[Variant, str]:
    """Return a label for each variant: its policy, and the fields in which the policy's differ."""
    found = list(dict.fromkeys(variants))

    def label(variant: Variant) -> str:
        same = [each for each in found if each.policy == variant.policy]
        differing = [
            getattr(variant, field) or _NO_FAULT
            for field in ("planner", "perception", "fault", "source")
            if len({getattr(each, field) for each in same}) > 1
        ]
        return ", ".join([variant.policy, *differing])

    return {variant: label(variant) for variant in found}


def baselines_of(variant: Variant, variants: Iterable[Variant], policy: str) -> tuple[Variant, ...]:
    """Return the variants that a variant is compared with.

    The first is the baseline policy with the same planner. Where there are several, the one under
    the most similar conditions is taken: the same table, then the same fault, then the same
    perception. The second is the same variant in the first of several tables.

    Args:
        variant: the variant to compare.
        variants: all variants, those of the first table first.
        policy: name of the baseline policy.
    """
    known = tuple(variants)
    found: list[Variant] = []
    candidates = [
        each for each in known if each.policy == policy and each.planner == variant.planner
    ]
    if candidates and variant.policy != policy:
        found.append(
            max(
                candidates,
                key=lambda each: (
                    each.source == variant.source,
                    each.fault == variant.fault,
                    not each.fault,
                    each.perception == variant.perception,
                ),
            )
        )
    same = [replace(each, source="") for each in known]
    earlier = known[same.index(replace(variant, source=""))]
    if earlier != variant:
        found.append(earlier)
    return tuple(found)
