"""Frame specifications and frame numbers in file names."""

from __future__ import annotations

import pytest
from tyndall_usd.cli.exit_codes import UsageError
from tyndall_usd.cli.frames import has_placeholder, insert_frame, parse_frames


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1001", [1001]),
        ("1001:1005x2,1020", [1001, 1003, 1005, 1020]),
        ("101:104", [101, 102, 103, 104]),
        ("3:1", [3, 2, 1]),
        ("5:1x-2", [5, 3, 1]),
        ("1:2x0.25", [1, 1.25, 1.5, 1.75, 2]),
        ("-2:1", [-2, -1, 0, 1]),
        ("1,1,2", [1, 2]),
        ("0.1:0.3x0.1", [0.1, 0.2, 0.30000000000000004]),
        (" 1 , 2 ", [1, 2]),
    ],
)
def test_specifications(text, frames):
    assert parse_frames(text) == pytest.approx(frames)


@pytest.mark.parametrize(
    "text", ["", "a", "1:", "1:2x", "1-5", "1:5x0", "1:5x-1", "1,,2", "1:2:3", "1:1e9", "nan"]
)
def test_nonsense_is_refused(text):
    with pytest.raises(UsageError, match="--frames"):
        parse_frames(text)


def test_endless_ranges_are_refused():
    with pytest.raises(UsageError, match="at most"):
        parse_frames("1:99999999")


@pytest.mark.parametrize(
    ("path", "frame", "expected"),
    [
        ("a.####.exr", 7, "a.0007.exr"),
        ("a.#.exr", 1234, "a.1234.exr"),
        ("a.$F4.exr", 7, "a.0007.exr"),
        ("a.$F.exr", 7, "a.7.exr"),
        ("a.%04d.exr", 7, "a.0007.exr"),
        ("a.###.##.exr", 7.25, "a.007.25.exr"),
        ("a.####.exr", -7, "a.-007.exr"),
        ("a.exr", 7, "a.exr"),
    ],
)
def test_numbers_in_names(path, frame, expected):
    assert insert_frame(path, frame) == expected
    assert has_placeholder(path) == (path != expected)


def test_a_fraction_needs_a_place():
    with pytest.raises(UsageError, match=r"fraction.*###\.###"):
        insert_frame("a.####.exr", 1.5)
