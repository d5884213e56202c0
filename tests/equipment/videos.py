"""Short videos for tests: a yellow square moves over a blue ground.

They are in ``videos.json``. ``python -m equipment.videos`` in the folder ``tests``
encodes them with Chromium and writes the file; the bytes differ from version to version
of Chromium, so the tests use the stored ones.
"""

import base64
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

FILE = Path(__file__).with_suffix(".json")

FORMATS = {
    "h264": ("avc1.42001f", 16, {"avc": {"format": "annexb"}}),
    "vp9": ("vp09.00.10.08", 4, {}),
}
"""The codec, the number of pictures and more for each name of a format."""

EVERY = 8
"""Each eighth picture is a key picture."""


def packets(format: str) -> list[bytes]:
    """Return the packets of a video; the first and each eighth is a key picture."""
    return [base64.b64decode(each) for each in json.loads(FILE.read_text())[format]]


ENCODE = """async ([codec, count, more]) => {
    const packets = [];
    const encoder = new VideoEncoder({
        output: (chunk) => {
            const data = new Uint8Array(chunk.byteLength);
            chunk.copyTo(data);
            packets.push(btoa(String.fromCharCode(...data)));
        },
        error: (error) => packets.push(String(error)),
    });
    encoder.configure({
        codec, width: 160, height: 120, bitrate: 60000, framerate: 15,
        latencyMode: "realtime", ...more,
    });
    const canvas = new OffscreenCanvas(160, 120);
    const pen = canvas.getContext("2d");
    for (let number = 0; number < count; number++) {
        pen.fillStyle = "#205080";
        pen.fillRect(0, 0, 160, 120);
        pen.fillStyle = "#f0c020";
        pen.fillRect(number * 8, 30, 40, 60);
        const frame = new VideoFrame(canvas, { timestamp: number * 66667 });
        encoder.encode(frame, { keyFrame: number % 8 === 0 });
        frame.close();
    }
    await encoder.flush();
    return packets;
}"""


class _Blank(BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.send_header("content-type", "text/html")
        self.end_headers()

    def log_message(self, format, *args):
        pass


def main():
    """Encode all videos and write the file."""
    from playwright.sync_api import sync_playwright

    from equipment.chromium import CHROMIUM_ARGS, chromium_path

    server = ThreadingHTTPServer(("127.0.0.1", 0), _Blank)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with sync_playwright() as started:
        browser = started.chromium.launch(
            executable_path=chromium_path(), args=CHROMIUM_ARGS
        )
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/")
        videos = {name: page.evaluate(ENCODE, list(of)) for name, of in FORMATS.items()}
        browser.close()
    FILE.write_text(json.dumps(videos, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
