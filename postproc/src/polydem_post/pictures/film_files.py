"""Files of films: MP4 by the ffmpeg that the package imageio-ffmpeg carries, GIF by Pillow."""

from __future__ import annotations

import errno
import re
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from PIL import Image

from ..base.new_file import MARK
from ..base.result_file import ResultError

#: H.264 with 4:2:0 colours, which every player reads, and the index at the start of the file; at quality 18 no losses
#: are visible
MP4 = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-preset", "fast", "-movflags", "+faststart",
       "-fflags", "+bitexact", "-flags:v", "+bitexact", "-metadata", f"comment={MARK}"]


def write_mp4(path: Path, size: tuple[int, int], fps: float, frames: Iterable[bytes]) -> None:
    """Write frames of red, green and blue as H.264."""
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise ResultError("films in MP4 need the package imageio-ffmpeg: .venv/bin/pip install imageio-ffmpeg; "
                          "GIF works without it") from error
    pixels = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}", "-i", "-"]
    call = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", *pixels, *MP4, f"file:{path}"]
    with tempfile.TemporaryFile() as said:
        with subprocess.Popen(call, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said) as ffmpeg:
            assert ffmpeg.stdin is not None
            try:
                for frame in frames:
                    ffmpeg.stdin.write(frame)
            except BrokenPipeError:  # ffmpeg has ended early; its exit code and its last line say why
                pass
            except BaseException:
                ffmpeg.kill()
                raise
            finally:
                with suppress(BrokenPipeError):
                    ffmpeg.stdin.close()
        if ffmpeg.returncode != 0 or not path.exists():
            said.seek(0)
            lines = said.read().decode(errors="replace").splitlines() or [f"exit code {ffmpeg.returncode}"]
            number = errno.EIO if path.parent.is_dir() else errno.ENOENT
            raise OSError(number, "ffmpeg: " + re.sub(r"^(\[[^]]*\] )+", "", lines[-1]))


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
        path, save_all=True, append_images=rest(), duration=max(10 * round(100.0 / fps), 20), loop=0, optimize=False,
        comment=MARK.encode())


def _palette(images: list[Image.Image]) -> Image.Image:
    """One palette for all frames from some of them."""
    chosen = images[:: max(len(images) // 4, 1)]
    width, height = chosen[0].size
    sheet = Image.new("RGB", (width, height * len(chosen)))
    for place, image in enumerate(chosen):
        sheet.paste(image, (0, place * height))
    return sheet.quantize(256, method=Image.Quantize.MEDIANCUT)
