#!/usr/bin/env python3
"""The project's conformance cases for RFC 6455 (the WebSocket protocol) against a running daemon.

    tests/edge/rfc6455.py                           # starts build/release/windsplat
    tests/edge/rfc6455.py --program=build/dev/windsplat --growth-kib=0
    tests/edge/rfc6455.py --url=https://127.0.0.1:8443/ --ca=cert.pem --token-file=token
    tests/edge/rfc6455.py --only=ws.utf8 --verbose   # selected cases; --list prints all as a table

After each group the daemon must run, serve a well-behaved client and hold at most one megabyte
more. Exit code 0: every case passed."""
import sys

import suite
import ws_endings
import ws_frames
import ws_handshake

if __name__ == "__main__":
    sys.exit(suite.main([*ws_handshake.groups(), *ws_frames.groups(), *ws_endings.groups()],
                        suite.parser_of(__doc__.splitlines()[0]).parse_args()))
