"""What notebooks show of a run: pictures with boxes, and a slider through them."""

import base64
import html

_COLORS = {"tracking": "#2ea043", "unsure": "#d29922", "occluded": "#e5732d", "lost": "#8b949e"}
# The slider shows one of the pictures beside it and hides the others; without scripts the first one stands alone.
_SLIDE = (
    "const p=this.parentNode;p.querySelectorAll('svg').forEach((s,k)=>s.style.display=k==this.value?'block':'none');"
    "p.querySelector('output').textContent=p.querySelectorAll('svg')[this.value].dataset.said"
)


def _said(frame, estimates):
    if not estimates:
        return f"frame {frame}"
    states = ", ".join(f"{e.target}: {e.state}" if len(estimates) > 1 else f"{e.state}, score {e.score:.2f}" for e in estimates)
    return f"frame {frame}, {estimates[0].time_s:.2f} s: {states}"


def _svg(jpeg, size, place, said, estimates, hidden):
    width, height = size
    left, top, x, y = place
    drawn = []
    for e in estimates:
        if e.state == "lost":
            continue
        at = ((e.box[0] - left) / x, (e.box[1] - top) / y, e.box[2] / x, e.box[3] / y)
        dashes = "" if e.state == "tracking" else ' stroke-dasharray="4 3"'
        drawn.append(
            '<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="{}" stroke-width="2"{}/>'.format(
                *at, _COLORS[e.state], dashes
            )
        )
    return (
        f'<svg viewBox="0 0 {width} {height}" width="{width}" height="{height}" data-said="{html.escape(said)}" '
        f'style="display:{"none" if hidden else "block"};max-width:100%">'
        f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"/>'
        f"{''.join(drawn)}</svg>"
    )


def _size_of(jpeg):
    """Columns and rows of a JPEG file, from its frame header."""
    at = 2
    while at + 9 < len(jpeg):
        marker, length = jpeg[at + 1], int.from_bytes(jpeg[at + 2 : at + 4], "big")
        if 0xC0 <= marker <= 0xC2:
            return int.from_bytes(jpeg[at + 7 : at + 9], "big"), int.from_bytes(jpeg[at + 5 : at + 7], "big")
        at += 2 + length
    raise ValueError("no picture")


def scrubber(pictures, place, estimates):
    """HTML of a slider through pictures, [(frame, JPEG)], with the boxes of estimates, pixels of the input, drawn on them.

    place: (left, top, x, y) of the pictures in the input, and how many of its pixels one of theirs is.
    """
    if not pictures:
        return ""
    wanted = {frame for frame, _ in pictures}
    by_frame = {}
    for e in estimates:
        if e.frame in wanted:
            by_frame.setdefault(e.frame, []).append(e)
    shown, said = [], []
    for frame, jpeg in pictures:
        there = by_frame.get(frame, [])
        said.append(_said(frame, there))
        shown.append(_svg(jpeg, _size_of(jpeg), place, said[-1], there, hidden=bool(shown)))
    slider = (
        f'<input type="range" min="0" max="{len(shown) - 1}" value="0" style="width:320px" '
        f'aria-label="frame" oninput="{html.escape(_SLIDE)}"/> '
    )
    return f"<div>{''.join(shown)}{slider if len(shown) > 1 else ''}<output>{html.escape(said[0])}</output></div>"
