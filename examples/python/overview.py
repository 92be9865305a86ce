"""What happens to a photograph: the picture, its silhouette, the hull, and a new view from there, side by side.

    overview.py CAPTURE SHOT OUTPUT.png
"""

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

import lumihull

Picture = npt.NDArray[np.uint8]


def over(rgba: npt.NDArray[Any], background: tuple[int, int, int]) -> Picture:
    """The picture laid over a colour, (h, w, 3)."""
    alpha = rgba[:, :, 3:4] / 255.0
    return np.asarray(rgba[:, :, :3] * alpha + np.array(background) * (1 - alpha) + 0.5).astype(np.uint8)


def main() -> None:
    folder, name, output = sys.argv[1:4]
    capture = lumihull.Capture.open(folder)
    shot = capture.names.index(name)
    view = capture.view(shot)
    photo = np.asarray(capture.read_photo(shot))
    mask = np.repeat(np.asarray(capture.read_mask(shot)).reshape(photo.shape[0], photo.shape[1], 1), 3, axis=2)
    hull = over(np.asarray(lumihull.Renderer(capture, "shaded").render(view, rays=3).rgba), (60, 60, 66))
    new = over(np.asarray(lumihull.Renderer(capture, "lumigraph").render(view, rays=3).rgba), (255, 255, 255))
    rows, columns = np.nonzero(mask[:, :, 0] > 127)
    margin = (rows.max() - rows.min()) // 8
    top, left = max(rows.min() - margin, 0), max(columns.min() - margin, 0)
    window = np.s_[top : rows.max() + margin, left : columns.max() + margin]
    row = np.concatenate([photo[window], mask[window], hull[window], new[window]], axis=1)
    half = row[: row.shape[0] // 2 * 2, : row.shape[1] // 2 * 2].astype(np.float32)
    half = (half[0::2, 0::2] + half[1::2, 0::2] + half[0::2, 1::2] + half[1::2, 1::2]) / 4
    lumihull.write_png(output, half.astype(np.uint8))


if __name__ == "__main__":
    try:
        main()
    except lumihull.Error as error:
        sys.exit(f"{error.subject}: {error.message}")
