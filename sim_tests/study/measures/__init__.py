"""Metrics of crossings, their statistics over many episodes, and ``awarenav compare``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._answering import answering_note
    from ._attention import (
        ATTENTION_WITHIN_M,
        ATTENTIVE_FROM,
        UNAWARE_UP_TO,
        UNCONFIRMED,
        MeasuredAttention,
        measured_part,
    )
    from ._bootstrap import (
        bootstrap_interval,
        ratio_interval,
        resampled_interval,
        resampled_means,
    )
    from ._conduct import OVERSHOOT_MPS, Conduct, fastest_point_excess_mps, limit_excess_mps
    from ._driving import path_length_m
    from ._interval import FEW_PAIRS, Interval, proportion_interval, zero_of_n_upper
    from ._measure import measure
    from ._metrics import METRICS, SHARES, Metric
    from ._pairs import (
        paired,
        paired_difference,
        violates_more,
        violation_excess,
        violation_excess_of_time,
        won_back,
    )
    from ._ratios import RATIOS, Ratio
    from ._record import RECORD_COLUMNS, EpisodeRecord, record_row
    from ._record_file import (
        read_record_file,
        read_records,
        salvage_record_file,
        write_records,
    )
    from ._step_out import (
        FASTER_STEP_OUT,
        STEP_OUT,
        StepOut,
        StepOutImpacts,
        step_out_impacts,
    )
    from ._summary import BASELINE, Comparison, Summary, SummaryRow, summarise
    from ._summary_text import nondeterminism_notes, summary_text, table_text
    from ._trace import Trace
    from ._variants import Variant, labels

__all__ = [
    "ATTENTION_WITHIN_M",
    "ATTENTIVE_FROM",
    "BASELINE",
    "FASTER_STEP_OUT",
    "FEW_PAIRS",
    "METRICS",
    "OVERSHOOT_MPS",
    "RATIOS",
    "RECORD_COLUMNS",
    "SHARES",
    "STEP_OUT",
    "UNAWARE_UP_TO",
    "UNCONFIRMED",
    "Comparison",
    "Conduct",
    "EpisodeRecord",
    "Interval",
    "MeasuredAttention",
    "Metric",
    "Ratio",
    "StepOut",
    "StepOutImpacts",
    "Summary",
    "SummaryRow",
    "Trace",
    "Variant",
    "answering_note",
    "bootstrap_interval",
    "fastest_point_excess_mps",
    "labels",
    "limit_excess_mps",
    "measure",
    "measured_part",
    "nondeterminism_notes",
    "paired",
    "paired_difference",
    "path_length_m",
    "proportion_interval",
    "ratio_interval",
    "read_record_file",
    "read_records",
    "record_row",
    "resampled_interval",
    "resampled_means",
    "salvage_record_file",
    "step_out_impacts",
    "summarise",
    "summary_text",
    "table_text",
    "violates_more",
    "violation_excess",
    "violation_excess_of_time",
    "won_back",
    "write_records",
    "zero_of_n_upper",
]

__getattr__ = lazy_page(__name__, __file__)
