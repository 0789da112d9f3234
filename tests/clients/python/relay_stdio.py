"""The Python side of a live widget over pipes: a line of JSON for each message, both ways.

Usage: relay_stdio.py URL DATASET. The line {"ask": "view"} is answered by the present view.
"""
import base64
import json
import sys
import threading

from support import windsplat

from windsplat.relay import Relay

written = threading.Lock()


def write(document):
    with written:
        sys.stdout.write(json.dumps(document) + "\n")
        sys.stdout.flush()


def send(message, buffers):
    write({"message": message, "buffers": [base64.b64encode(one).decode() for one in buffers]})


server = windsplat.connect(sys.argv[1])
dataset = server[sys.argv[2]]
relay = Relay(dataset.view(size=(400, 240)), send)
write({"title": dataset.title, "steps": [step.text for step in dataset.steps],
       "html": dataset.view(step=3).widget(height=240)._repr_html_()})
for line in sys.stdin:
    document = json.loads(line)
    if document.get("ask") == "view":
        write({"view": relay.view.to_dict()})
    else:
        relay.receive(document)
relay.close()
server.close()
