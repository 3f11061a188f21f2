"""A speaker that keeps what it is given."""

import json


class Said:
    """`messages`: everything that was sent."""

    def __init__(self):
        self.messages = []

    def send(self, message):
        self.messages.append(message)

    def close(self):
        pass

    def lines(self):
        return [json.loads(message) for message in self.messages]
