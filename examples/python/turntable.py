"""Opens a capture, makes its model where that is not up to date, and renders eight views around the object."""

import sys

import lumihull


def main() -> None:
    capture = lumihull.Capture.open(sys.argv[1])
    for result in capture.run():
        print(result.stage, "skipped" if result.skipped else f"{result.seconds:.1f} s", *result.lines, sep="; ")

    renderer = lumihull.Renderer(capture, "lumigraph")
    for i, view in enumerate(renderer.turntable(8, 320, 240, elevation=0.35)):
        rgba = renderer.render(view).rgba  # a NumPy array: (240, 320, 4) uint8
        lumihull.write_png(f"turntable_{i}.png", rgba)
        print(f"turntable_{i}.png", "object covers", f"{(rgba[:, :, 3] > 127).mean():.0%}")


if __name__ == "__main__":
    try:
        main()
    except lumihull.Error as error:
        sys.exit(f"{error.subject}: {error.message}")
