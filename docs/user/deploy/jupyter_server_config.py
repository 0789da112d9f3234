# An entry "windsplat" in the launcher of JupyterLab, also in a JupyterHub: jupyter-server-proxy
# starts a daemon for each user when it is first opened. This file goes to a folder that
# `jupyter --paths` lists under config, or its lines into the jupyter_server_config.py there.
import os
import pathlib
import secrets

from jupyter_core.paths import jupyter_runtime_dir

# The name of the hub in the browser. A JupyterLab at localhost needs none.
hub = "hub.example"

# Other users of this machine may reach the daemon's port: it requires a token, which only this
# user's server knows and adds to every request.
token = secrets.token_hex(32)
token_file = pathlib.Path(jupyter_runtime_dir()) / f"windsplat-{os.getpid()}.token"
token_file.parent.mkdir(parents=True, exist_ok=True)
token_file.unlink(missing_ok=True)
token_file.touch(mode=0o600)
token_file.write_text(token + "\n")

c.ServerProxy.servers = {  # noqa: F821: Jupyter defines c
    "windsplat": {
        "command": ["windsplat", "serve", "--listen", "127.0.0.1:{port}",
                    "--base-path", "{base_url}windsplat/", "--token-file", str(token_file),
                    "--allow-host", hub, "--data-root", os.path.expanduser("~"),
                    "--memory-limit", "4G"],
        "absolute_url": True,
        "timeout": 30,
        "request_headers_override": {"Authorization": f"Bearer {token}"},
        "launcher_entry": {"title": "windsplat"},
    }
}
