"""A small site for tests of single modules of the page: its files, and JSON that a test gives."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

from specc.tools.page.server import STATIC

DOCUMENT = """<!doctype html><link rel="icon" href="/icon.svg">
<style>
  body { margin: 0; }
  #box { position: relative; width: 400px; height: 300px; }
  canvas { width: 100%; height: 100%; display: block; }
</style>
<div id="box"><canvas id="canvas"></canvas></div><div id="beside"></div>
"""
_KINDS = {".js": "text/javascript", ".html": "text/html", ".json": "application/json"}


@contextmanager
def site(**data: Any) -> Iterator[str]:
    """The address of a site: `/`, `/static/NAME` and `/NAME.json` with the data of each name."""
    files = {f"/static/{path.name}": path.read_bytes() for path in STATIC.glob("*.js")}
    files |= {f"/{name}.json": json.dumps(value).encode() for name, value in data.items()}
    files |= {"/": DOCUMENT.encode(), "/icon.svg": b"<svg/>"}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = files.get(self.path)
            self.send_response(404 if body is None else 200)
            suffix = "." + self.path.rpartition(".")[2]
            self.send_header("Content-Type", _KINDS.get(suffix, "text/html"))
            self.end_headers()
            self.wfile.write(body or b"")

        def log_message(self, format: str, *args: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
