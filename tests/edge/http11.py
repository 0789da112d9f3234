#!/usr/bin/env python3
"""Edge cases of HTTP/1.1 (RFC 9110, RFC 9112) against a running daemon.

    tests/edge/http11.py                             # starts build/release/windsplat
    tests/edge/http11.py --program=build/dev/windsplat --growth-kib=0
    tests/edge/http11.py --url=https://127.0.0.1:8443/ --ca=cert.pem --token-file=token
    tests/edge/http11.py --only=http.coding --verbose # selected cases; --list prints all as a table

After each group the daemon must run, serve a well-behaved client and hold at most one megabyte
more. Exit code 0: every case passed."""
import sys

import http_connections
import http_requests
import suite

if __name__ == "__main__":
    sys.exit(suite.main([*http_requests.groups(), *http_connections.groups()],
                        suite.parser_of(__doc__.splitlines()[0]).parse_args()))
