"""Metrics of crossings, and their statistics over many episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._awareness import ATTENTION_WITHIN_M, ATTENTIVE_FROM, UNAWARE_UP_TO, MeasuredAttention
    from ._driving import (
        OVERSHOOT_MPS,
        Conduct,
        fastest_point_excess_mps,
        limit_excess_mps,
        path_length_m,
        success_weighted,
    )
    from ._metrics import COLUMNS, METRICS
    from ._record import (
        RECORD_COLUMNS,
        EpisodeRecord,
        measure,
        read_records,
        record_row,
        write_records,
    )
    from ._registry import NOTICED, RATIOS, SHARES, STEP_OUT_PEOPLE, Metric
    from ._statistics import (
        FEW_PAIRS,
        NOTHING,
        THIN,
        Interval,
        bootstrap_interval,
        number_text,
        paired,
        paired_difference,
        percent,
        proportion_interval,
        resampled_interval,
        resampled_means,
        violates_more,
        zero_of_n_upper,
    )
    from ._step_out import FAST_IMPACT_MPS, StepOut, step_out_impacts
    from ._summary import (
        BASELINE,
        UNCONFIRMED,
        Comparison,
        Summary,
        SummaryRow,
        Variant,
        labels,
        measured_part,
        summarise,
        summarise_sources,
    )
    from ._summary_text import nondeterminism_notes, short_text, summary_text

__getattr__ = lazy_page(__name__, __file__)
