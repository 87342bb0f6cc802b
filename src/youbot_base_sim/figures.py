"""The common part of this package's figures. numpy and matplotlib are imported when something is drawn, without a
display: programs that install them know the colours before."""
import io
from pathlib import Path

from .base import WHEELS
from .command_line import Refused, printable, shown
from .files import write_whole

# Okabe and Ito's colours, which the colour-blind can distinguish, and those of the wheels.
BLACK, BLUE, RED, GREEN, PINK, SKY, ORANGE, GREY = (
    "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#777777")
WHEEL_COLOURS = dict(zip(WHEELS, (BLUE, RED, GREEN, PINK)))
WHEEL_NAMES = ("front left", "front right", "back left", "back right")  # in the order of WHEELS
BINS = 1200  # a curve's highest and lowest point in each are drawn: more could not be seen


def new_figure(**options):
    """A figure of matplotlib that needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    figure = Figure(**options)
    FigureCanvasAgg(figure)
    return figure


def picture(figure, format="png", **options):
    """The figure in a format of matplotlib's; a PNG in 256 colours, which makes it half as large."""
    content = io.BytesIO()
    figure.savefig(content, format=format, **options)
    if format == "png":
        from PIL import Image
        image = Image.open(content).convert("RGB").quantize(256)
        image.save(content := io.BytesIO(), "PNG", optimize=True)
    return content.getvalue()


def save(figure, path, **options):
    """Writes the figure whole, in the format of the file's ending, else as PNG. Throws Refused, Failed."""
    ending = Path(path).suffix[1:].lower() or "png"
    try:
        write_whole(path, picture(figure, format=ending, **options))
    except ValueError as error:  # of matplotlib: no format of this name
        raise Refused(f"{shown(path)}: {error}")


def plain(text):
    """Text of a file as matplotlib shows it: to it "$" would begin mathematics."""
    return printable(text).replace("$", r"\$")


def thinned(*columns):
    """Indices of curves' points that are seen: where one curve is highest or lowest in each of BINS stretches."""
    import numpy as np
    count = len(columns[0])
    if count <= 4 * BINS:
        return np.arange(count)
    extremes = [stretch[extreme(np.nan_to_num(column[stretch], nan=blank))]
                for stretch in np.array_split(np.arange(count), BINS) for column in columns
                for blank, extreme in ((np.inf, np.argmin), (-np.inf, np.argmax))]
    return np.unique([0, *extremes, count - 1])


def curve(axis, t, y, **style):
    """Draws y over t, thinned."""
    i = thinned(y)
    return axis.plot(t[i], y[i], **style)
