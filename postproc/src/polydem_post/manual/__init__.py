"""The manual: one searchable site from the Markdown pages of the repository, where they lie."""
