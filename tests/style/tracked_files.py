"""Which files the rules are for: those that git tracks, so that drafts beside them spoil no test."""

import os
import subprocess


def tracked_files(root):
    """Paths of the tracked files that exist, from the root; None where the root is no repository, as in an archive."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z"], capture_output=True, text=True, check=False)
    if listed.returncode or not os.path.exists(os.path.join(root, ".git")):
        return None
    return {name for name in listed.stdout.split("\0") if name and os.path.exists(os.path.join(root, name))}
