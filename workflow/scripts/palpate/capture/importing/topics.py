"""Which topics of a bag are meant: by their types, by their names, or because a person says so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from palpate.capture.importing.bags import (
    CAMERA_INFO,
    COMPRESSED,
    IMAGE,
    WRENCH,
    WRENCH_STAMPED,
    Bag,
    shown,
)
from palpate.capture.importing.pixels import Form, form_of, taken

# image_transport puts these behind the name of the plain image.
CODECS = ("compressed", "compressedDepth")
# Layout of the RealSense SDK's recorder: <stream>/image/data, <stream>/info/camera_info.
REALSENSE_DATA = "/image/data"
REALSENSE_INFO = "/info/camera_info"
MOST_SHOWN = 8


@dataclass(frozen=True)
class Names:
    """Topics that a person named, and what was said of them.

    Parameters
    ----------
    color, depth, wrench, color_info, depth_info : str, optional
        Topics; found by their types if not given.
    registered : bool
        Whether depth is known to be registered to colour.
    receive_clock : bool
        Whether a wrench without a stamp may take the time of its receipt.
    depth_unit_m : float, optional
        What one count of the depth images is [m], whatever the recording states.
    """

    color: str | None = None
    depth: str | None = None
    wrench: str | None = None
    color_info: str | None = None
    depth_info: str | None = None
    registered: bool = False
    receive_clock: bool = False
    depth_unit_m: float | None = None


def image_forms(bag: Bag) -> tuple[dict[str, Form], list[str]]:
    """Form of the first image of each image topic, and what those hold that no capture can keep."""
    forms, others = {}, []
    for name in bag.topics(IMAGE, COMPRESSED):
        message = bag.first(name)
        try:
            forms[name] = form_of(message)
        except ValueError as error:
            others.append(f"{shown(name)} of {shown(str(error).rpartition('found ')[2])}")
    return forms, others


def wrench_topic(bag: Bag, names: Names) -> str:
    """Topic of the wrench.

    Raises
    ------
    ValueError
        If there is none, several, or one that has no stamps.
    """
    found = list(bag.topics(WRENCH_STAMPED, WRENCH))
    name = _chosen(bag, "wrench", found, names.wrench, "WrenchStamped")
    if bag.topics()[name].type == WRENCH and not names.receive_clock:
        expected = f"{WRENCH_STAMPED} (--receive-clock takes the times of receipt)"
        raise ValueError(f"{bag.path}: {shown(name)}: type: expected {expected}, found {WRENCH}")
    return name


def color_topic(
    bag: Bag, forms: Mapping[str, Form], asked: str | None, others: Sequence[str] = ()
) -> str:
    """Topic of the colour images; refuses if there is none or several."""
    color = [name for name, form in forms.items() if not form.is_depth]
    # Depth cameras often record their infrared image, which is grey, as well.
    coloured = [name for name in color if forms[name].stored != "mono8"]
    found = color if asked else coloured or color
    return _chosen(bag, "color", found, asked, taken(depth=False), _no_image(bag, others))


def depth_topic(
    bag: Bag, forms: Mapping[str, Form], asked: str | None, others: Sequence[str] = ()
) -> str:
    """Topic of the depth images; refuses if there is none or several."""
    found = [name for name, form in forms.items() if form.is_depth]
    return _chosen(bag, "depth", found, asked, taken(depth=True), _no_image(bag, others))


def _no_image(bag: Bag, others: Sequence[str]) -> str:
    """What is found where there is no such image: others, or topics of other types."""
    if others:
        return f"none but {others[0]}"
    topics = list(bag.topics().values())
    listed = ", ".join(f"{shown(one.name)} of {shown(one.type)}" for one in topics[:MOST_SHOWN])
    more = len(topics) - MOST_SHOWN
    rest = f" and {more} other{'s' if more > 1 else ''}" if more > 0 else ""
    return f"none (it holds {listed or 'no messages'}{rest})"


def _chosen(
    bag: Bag,
    what: str,
    found: list[str],
    asked: str | None,
    kind: str,
    none: str = "none",
) -> str:
    if asked in found or (not asked and len(found) == 1):
        return asked or found[0]
    listed = ", ".join(map(shown, found)) or none
    if asked:
        held = bag.topics().get(asked)
        here = f"{held.type} that can't serve" if held else "no such topic"
        expected = f"a topic of {kind}: {listed}"
        raise ValueError(f"{bag.path}: --{what} {shown(asked)}: expected {expected}, found {here}")
    which = f", named by --{what}" if found else ""
    raise ValueError(f"{bag.path}: {what}: expected one topic of {kind}{which}, found {listed}")


def info_topic(bag: Bag, image: str, asked: str | None) -> str | None:
    """CameraInfo that belongs to an image topic by its name."""
    infos = bag.topics(CAMERA_INFO)
    if asked:
        return _chosen(bag, "camera_info", list(infos), asked, CAMERA_INFO)
    parts = image.split("/")
    base = parts[:-1] if parts[-1] in CODECS else parts
    names = ["/".join([*base[:-1], "camera_info"]), image.removesuffix(REALSENSE_DATA)]
    names[1] += REALSENSE_INFO
    return next((name for name in names if name in infos), None)
