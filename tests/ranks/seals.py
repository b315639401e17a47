"""Seals of checkpoints, so that a changed one is believed; file_checksum.f90 says what a seal is."""

import zlib

#: Bytes of a seal
SEAL = 512


def seal(path):
    """Give a file the seal that fits the bytes behind it."""
    with open(path, "r+b") as file:
        file.seek(SEAL)
        data = file.read()
        file.seek(0)
        file.write(f"polydem: {len(data)} bytes follow, CRC-32 {zlib.crc32(data):08x}".ljust(SEAL - 1).encode() + b"\n")


def seal_list(path, change):
    """Change the lines of a manifest above its checksum, which then fits them."""
    lines, _, _ = path.read_text(encoding="utf-8").rpartition("crc32 ")
    lines = change(lines)
    path.write_text(f"{lines}crc32 {zlib.crc32(lines.encode()):08x}\n", encoding="utf-8")
