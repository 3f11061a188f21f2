"""A sink that keeps what is sent to it."""

import json


class RecordingSink:
    """`messages`: everything that was sent."""

    def __init__(self):
        self.messages = []

    def send(self, message):
        self.messages.append(message)

    def close(self):
        pass

    def lines(self):
        return [json.loads(message) for message in self.messages]
