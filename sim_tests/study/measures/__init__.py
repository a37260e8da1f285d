"""Metrics of crossings, their statistics over many episodes, and ``awarenav compare``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._awareness import (
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
    from ._compare import answering_note
    from ._conduct import OVERSHOOT_MPS, Conduct, fastest_point_excess_mps, limit_excess_mps
    from ._driving import path_length_m
    from ._interval import FEW_PAIRS, Interval, proportion_interval, zero_of_n_upper
    from ._measure import measure
    from ._pairs import (
        paired,
        paired_difference,
        violates_more,
        violation_excess,
        violation_excess_of_time,
        won_back,
    )
    from ._record import COLUMNS, METRICS, RATIOS, SHARES, EpisodeRecord, Metric
    from ._record_file import (
        RECORD_COLUMNS,
        read_records,
        read_rows,
        record_row,
        write_records,
    )
    from ._step_out import StepOut, step_out_impacts
    from ._summary import BASELINE, Comparison, Summary, SummaryRow, Variant, labels, summarise
    from ._summary_text import nondeterminism_notes, summary_text, table_text
    from ._trace import Trace

__all__ = [
    "ATTENTION_WITHIN_M",
    "ATTENTIVE_FROM",
    "BASELINE",
    "COLUMNS",
    "FEW_PAIRS",
    "METRICS",
    "OVERSHOOT_MPS",
    "RATIOS",
    "RECORD_COLUMNS",
    "SHARES",
    "UNAWARE_UP_TO",
    "UNCONFIRMED",
    "Comparison",
    "Conduct",
    "EpisodeRecord",
    "Interval",
    "MeasuredAttention",
    "Metric",
    "StepOut",
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
    "read_records",
    "read_rows",
    "record_row",
    "resampled_interval",
    "resampled_means",
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
