"""The images of a recording, one by one, as files that a browser shows."""

from __future__ import annotations

from pathlib import Path

from specc_runtime.recording.depth import DEPTH
from specc_runtime.recording.pictures import COMPRESSED, RAW, shown_message
from specc_runtime.recording.reading import Channel, Message, RecordFile, Schema

_SCHEMAS = COMPRESSED, RAW, DEPTH
_ROUNDING_S = 1e-6


class Gallery:
    """The topics of a recording that have images, and the image of a topic at a time.

    Each look reads the file up to that time, but unpacks only chunks that have images of the topic.
    """

    def __init__(self, path: Path) -> None:
        """Raises Unusable."""
        self._path = path
        self._schemas = _image_topics(path)
        self.topics = tuple(sorted(self._schemas))

    def picture(self, topic: str, time_s: float) -> tuple[float, bytes] | None:
        """The last image of a topic until then: its time in s, and a JPEG or PNG.

        Raises Unusable; Misshapen for an image that cannot be read.
        """
        if topic not in self._schemas:
            return None
        last: tuple[float, bytes] | None = None
        channels: set[int] = set()
        for record in RecordFile(self._path, [topic]):
            if isinstance(record, Channel) and record.topic == topic:
                channels.add(record.id)
            elif isinstance(record, Message) and record.channel_id in channels:
                now_s = record.log_time / 1e9
                if now_s <= time_s + _ROUNDING_S and (last is None or now_s >= last[0]):
                    last = now_s, record.data
        if last is None:
            return None
        data = shown_message(last[1], self._schemas[topic])
        return None if data is None else (last[0], data)


def _image_topics(path: Path) -> dict[str, str]:
    """The schemas of the topics that have images."""
    names: dict[int, str] = {}
    found: dict[str, str] = {}
    for record in RecordFile(path, ["/"]):  # a topic that nothing has: no chunk is unpacked
        if isinstance(record, Schema):
            names[record.id] = record.name
        elif isinstance(record, Channel) and names.get(record.schema_id) in _SCHEMAS:
            found[record.topic] = names[record.schema_id]
    return found
