"""Pictures with a caption, and films of them as MP4 or GIF."""

from __future__ import annotations

import itertools
import subprocess
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agail._core import InputError
from agail._extension import missing

if TYPE_CHECKING:
    from PIL import Image, ImageFont

LONGEST = "step 10000   return -10,000.0   terminated"  # has to fit
FORMATS = (".mp4", ".gif")


def _pillow() -> Any:
    try:
        import PIL.Image
        import PIL.ImageDraw
        import PIL.ImageFont
    except ImportError as error:
        raise missing("pillow", "video") from error
    return PIL


@cache
def _font(width: int) -> ImageFont.FreeTypeFont:
    """As large as is easily read, if two margins and the longest line fit into the width."""
    load = _pillow().ImageFont.load_default
    largest = max(14, width // 30)
    return next(
        (font for font in map(load, range(largest, 6, -1)) if font.getlength(LONGEST) < 0.95 * width),
        load(6),
    )  # fmt: skip


def captioned(
    picture: NDArray[np.uint8], size: tuple[int, int], lines: tuple[str, str]
) -> Image.Image:
    """The picture scaled into a frame of this width and height, with two lines of text at its top."""
    pil = _pillow()
    frame = pil.Image.new("RGB", size)
    scaled = pil.Image.fromarray(picture)
    factor = min(size[0] / scaled.width, size[1] / scaled.height)
    if factor != 1:
        inner = round(scaled.width * factor), round(scaled.height * factor)
        scaled = scaled.resize(inner, pil.Image.Resampling.LANCZOS)
    frame.paste(scaled, ((size[0] - scaled.width) // 2, (size[1] - scaled.height) // 2))
    font = _font(size[0])
    line = round(1.3 * font.size)
    band = (0, 0, size[0], 2 * line + line // 2)
    frame.paste(frame.crop(band).point(lambda value: value // 4), band)  # darkened
    draw = pil.ImageDraw.Draw(frame)
    for i, text in enumerate(lines):
        draw.text((font.size // 2, line // 4 + i * line), text, "white", font)
    return frame


def beside(frames: list[Image.Image]) -> Image.Image:
    """Frames of one size, from left to right."""
    width, height = frames[0].size
    row = _pillow().Image.new("RGB", (width * len(frames), height))
    for i, frame in enumerate(frames):
        row.paste(frame, (i * width, 0))
    return row


def possible_rate(path: Path, rate: float) -> float:
    """The nearest number of frames a second that the format has: a GIF counts in 1/100 s."""
    return 100 / max(2, round(100 / rate)) if path.suffix == ".gif" else rate


def _write_mp4(part: Path, frames: Iterator[Image.Image], rate: float) -> None:
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise missing("imageio-ffmpeg", "video") from error
    first = next(frames)
    size = "x".join(map(str, first.size))
    # Not imageio_ffmpeg.write_frames(), which takes no notice of a full disk at the end.
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error",
               "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(rate), "-i", "-",
               "-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", part]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as ffmpeg:
        try:
            for frame in itertools.chain([first], frames):
                ffmpeg.stdin.write(frame.tobytes())
        except BrokenPipeError:
            pass  # it says why
        except BaseException:
            ffmpeg.kill()
            raise
        _, said = ffmpeg.communicate()
    if ffmpeg.returncode != 0:
        reason = " ".join(said.decode(errors="replace").split()) or f"code {ffmpeg.returncode}"
        raise OSError(f"{part}: ffmpeg could not write it: {reason}")


def _write_gif(part: Path, frames: Iterator[Image.Image], rate: float) -> None:
    palette = _pillow().Image.Palette.ADAPTIVE
    first, *others = (frame.convert("P", palette=palette) for frame in frames)
    first.save(part, save_all=True, append_images=others, duration=round(1000 / rate), loop=0)


def write_film(path: Path, frames: Iterator[Image.Image], rate: float) -> None:
    """An MP4 (H.264) or a GIF, as the name ends: whole or not at all.

    frames: of one size, even numbers; rate: frames a second, see possible_rate(). InputError if the
    file cannot be created; OSError if the disk is full.
    """
    write: Callable[[Path, Iterator[Image.Image], float], None]
    write = _write_gif if path.suffix == ".gif" else _write_mp4
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        part.touch()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written ({error.strerror}); give another --out"
        ) from error
    try:
        write(part, frames, rate)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
