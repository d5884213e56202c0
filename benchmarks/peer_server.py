"""Moving robots in NiceGUI or viser, with the least work for the server.

Run as ``python peer_server.py nicegui|viser ROBOTS PORT`` with a Python that has these
packages. It does not use WebMap.
"""

import math
import sys
import time

RATE = 10
"""Steps of each robot a second."""


def place(number: int, side: int) -> tuple[float, float, float]:
    """Return the current x, y and yaw of a robot on a circle, as in ``fleet``."""
    turn = 0.7 * number + math.pi * time.monotonic()
    x, y = number % side * 4.0 + math.cos(turn), number // side * 4.0 + math.sin(turn)
    return x, y, turn + math.pi / 2


def show_in_nicegui(robots: int, port: int) -> None:
    """Send all robots as one SVG at each step; an element for each costs more."""
    from nicegui import ui

    side = math.ceil(math.sqrt(robots))

    def picture() -> str:
        shapes = []
        for number in range(robots):
            x, y, yaw = place(number, side)
            at = f"translate({x:.3f} {y:.3f}) rotate({math.degrees(yaw):.1f})"
            shapes.append(
                f'<g transform="{at}"><circle r="0.3" fill="steelblue"/>'
                '<line x2="0.3" stroke="white" stroke-width="0.05"/></g>'
            )
        box = f"-3 -3 {4 * side + 2} {4 * side + 2}"
        return f'<svg width="800" height="800" viewBox="{box}">{"".join(shapes)}</svg>'

    @ui.page("/")  # type: ignore[untyped-decorator]  # the package is not installed
    def main() -> None:
        shown = ui.html(picture(), sanitize=False)
        ui.timer(1 / RATE, lambda: shown.set_content(picture()))

    ui.run(port=port, host="127.0.0.1", show=False, reload=False)


def show_in_viser(robots: int, port: int) -> None:
    """Move a frame of axes for each robot."""
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=port)
    side = math.ceil(math.sqrt(robots))
    frames = [
        server.scene.add_frame(f"/robot_{number}", axes_length=0.5, axes_radius=0.05)
        for number in range(robots)
    ]
    due = time.monotonic()
    while True:
        due += 1 / RATE
        time.sleep(max(0.0, due - time.monotonic()))
        with server.atomic():
            for number, frame in enumerate(frames):
                x, y, yaw = place(number, side)
                frame.position = (x, y, 0.0)
                frame.wxyz = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))


if __name__ == "__main__":
    show = {"nicegui": show_in_nicegui, "viser": show_in_viser}[sys.argv[1]]
    show(int(sys.argv[2]), int(sys.argv[3]))
