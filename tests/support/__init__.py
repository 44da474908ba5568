"""What the whole-system tests share: running the renderer, reading its files, judging its numbers."""
