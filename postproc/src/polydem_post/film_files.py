"""Files of films: MP4 by the ffmpeg that the package imageio-ffmpeg carries, GIF by Pillow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from PIL import Image

from .result_file import ResultError

#: What every player reads: H.264 of 4:2:0 colours, the index at the start of the file; quality 18 shows no losses
MP4 = {
    "codec": "libx264",
    "pix_fmt_in": "rgb24",
    "pix_fmt_out": "yuv420p",
    "macro_block_size": 2,
    "quality": None,
    "output_params": ["-crf", "18", "-preset", "fast", "-movflags", "+faststart", "-fflags", "+bitexact",
                      "-flags:v", "+bitexact"],
}


def write_mp4(path: Path, size: tuple[int, int], fps: float, frames: Iterable[bytes]) -> None:
    """Write frames of red, green and blue as H.264."""
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise ResultError("films in MP4 need the package imageio-ffmpeg: .venv/bin/pip install imageio-ffmpeg; "
                          "GIF works without it") from error
    writer = imageio_ffmpeg.write_frames(str(path), size, fps=fps, ffmpeg_log_level="error", **MP4)
    writer.send(None)
    try:
        for frame in frames:
            writer.send(frame)
    finally:
        writer.close()
    if not path.exists() or path.stat().st_size == 0:
        raise ResultError(f"{path}: ffmpeg wrote nothing")


def write_gif(path: Path, size: tuple[int, int], fps: float, frames: Iterable[bytes]) -> None:
    """Write frames with one palette of 256 colours; times are multiples of 10 ms."""
    waiting = iter(frames)
    first = Image.frombytes("RGB", size, next(waiting))
    later = [Image.frombytes("RGB", size, frame) for frame, _ in zip(waiting, range(24))]
    palette = _palette([first, *later])

    def rest() -> Iterator[Image.Image]:
        for image in later:
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in waiting:
            yield Image.frombytes("RGB", size, frame).quantize(palette=palette, dither=Image.Dither.NONE)

    first.quantize(palette=palette, dither=Image.Dither.NONE).save(
        path, save_all=True, append_images=rest(), duration=max(10 * round(100.0 / fps), 20), loop=0, optimize=False)


def _palette(images: list[Image.Image]) -> Image.Image:
    """One palette for all frames from some of them."""
    chosen = images[:: max(len(images) // 4, 1)]
    width, height = chosen[0].size
    sheet = Image.new("RGB", (width, height * len(chosen)))
    for place, image in enumerate(chosen):
        sheet.paste(image, (0, place * height))
    return sheet.quantize(256, method=Image.Quantize.MEDIANCUT)
