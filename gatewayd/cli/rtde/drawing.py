"""Panels as a picture, by matplotlib."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from itertools import product

from gatewayd.cli.rtde.panels import Panel
from gatewayd.cli.rtde.plotted import Plotted
from gatewayd.rtde.recording import MissingExtraError

_SIZE = (6.0, 2.2)
"""Of a panel, in inches."""
_FEW = 4
"""Panels that stand below each other; more make columns."""
_LINE, _POINT = 0.9, 2.0


def draw(
    form: str, panels: Sequence[Panel], drawn: Mapping[str, Plotted], *, title: str, time_label: str
) -> bytes:
    """The picture, of the form `png`, `svg` or `pdf`. Raises MissingExtraError without matplotlib.

    `drawn` has the recordings by what they are called; of several, each has its curve in the panels.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtraError("A picture", "plot", "matplotlib") from error

    across = 1 if len(panels) <= _FEW else 2 if len(panels) <= 3 * _FEW else 3
    down = math.ceil(len(panels) / across)
    # Text stays text in an SVG: it is searched for and copied, and the file is a third of the size.
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "gatewayd", "agg.path.chunksize": 20000}):
        figure = Figure(figsize=(_SIZE[0] * across, _SIZE[1] * down + 0.6), layout="constrained")
        figure.suptitle(title)
        grid = figure.subplots(down, across, sharex=True, squeeze=False)
        # Down the columns, so that the six joints of a vector stand below each other.
        axes = [grid[place % down][place // down] for place in range(down * across)]
        for panel, area in zip(panels, axes, strict=False):
            for (name, found), curve in product(drawn.items(), panel.curves):
                if curve.column in found.values:
                    area.plot(
                        found.time,
                        found.values[curve.column],
                        label=curve.field if len(drawn) == 1 else f"{name}: {curve.field}",
                        linewidth=_LINE,
                        marker=".",
                        markersize=_POINT,
                        markevery=found.lone,
                        drawstyle="steps-post" if curve.stepped else "default",
                    )
            area.set_ylabel(panel.label, fontsize="small")
            area.grid(alpha=0.3)
            if len(drawn) * len(panel.curves) > 1:
                area.legend(fontsize="x-small", loc="upper right")
        for area in axes[len(panels) :]:
            area.set_visible(False)
        for lowest in {place // down: area for place, area in enumerate(axes[: len(panels)])}.values():
            lowest.set_xlabel(time_label)
            lowest.tick_params(labelbottom=True)
        picture = BytesIO()
        figure.savefig(picture, format=form, dpi=120, metadata={"Date": None} if form == "svg" else None)
    return picture.getvalue()
