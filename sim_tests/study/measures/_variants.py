"""Episodes by what was tried: policy, and planner, perception and fault where they differ."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from ._record import EpisodeRecord

_NO_FAULT: Final = "no fault"


@dataclass(frozen=True, slots=True)
class Variant:
    """What was tried.

    Attributes:
        policy: name.
        planner: name.
        perception: name.
        fault: name, empty for none.
        source: which table it comes from, empty when there is one.
    """

    policy: str
    planner: str = ""
    perception: str = ""
    fault: str = ""
    source: str = ""

    @classmethod
    def of(cls, record: EpisodeRecord, source: str = "") -> Variant:
        """What was tried in an episode."""
        return cls(record.policy, record.planner, record.perception, record.fault, source)


def labels(variants: Iterable[Variant]) -> dict[Variant, str]:
    """A name for each: the policy, and what tells it from others of the same policy."""
    found = list(dict.fromkeys(variants))

    def label(variant: Variant) -> str:
        same = [each for each in found if each.policy == variant.policy]
        telling = [
            getattr(variant, field) or _NO_FAULT
            for field in ("planner", "perception", "fault", "source")
            if len({getattr(each, field) for each in same}) > 1
        ]
        return ", ".join([variant.policy, *telling])

    return {variant: label(variant) for variant in found}


def baselines_of(variant: Variant, variants: Iterable[Variant], policy: str) -> tuple[Variant, ...]:
    """What a variant is compared with.

    First the baseline policy in the likest conditions: with the same planner, and if there is a
    choice from the same table, under the same fault and with the same perception, in this order.
    Then the same variant in the first of several tables.

    Args:
        variant: to be compared.
        variants: all there are; the first table's first.
        policy: name of the baseline.
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
