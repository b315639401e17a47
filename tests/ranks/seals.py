"""Seals of checkpoints, so that a changed one is believed; file_checksum.f90 says what a seal is."""

import struct

#: Bytes of a seal, and words of eight bytes in a slice
SEAL, SLICE = 512, 8192
ALL = (1 << 64) - 1


def finalise(number):
    """The 64-bit finaliser of MurmurHash3"""
    for factor in (0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53):
        number = (number ^ number >> 33) * factor & ALL
    return number ^ number >> 33


def mix(number, words):
    """The hash of a sequence, from that of what was before it"""
    for word in words:
        number = finalise(finalise(number) ^ word) + number & ALL
    return number


def seal(path):
    """Give a file the seal that fits the bytes behind it."""
    with open(path, "r+b") as file:
        file.seek(SEAL)
        data = file.read()
        words = struct.unpack(f"<{len(data) // 8}Q", data[:len(data) // 8 * 8])
        slices = [words[k:k + SLICE] for k in range(0, len(words), SLICE)]
        rest = int.from_bytes(data[len(words) * 8:], "little")
        number = mix(len(data), [*(mix(len(part), part) for part in slices), rest])
        file.seek(0)
        file.write(f"polydem: {len(data)} bytes follow, hash {number:016x}".ljust(SEAL - 1).encode() + b"\n")
