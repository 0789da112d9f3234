"""The requests of the fingerprint: (method, target, headers, body), in order. Requests that
change the daemon's state are last, so that the others do not depend on them."""
import json

DATASETS = ["tornado:24x24x24", "climate:32x16x6", "efield:16x16x16"]
ONE, CLIMATE = "tornado:24x24x24", "climate:32x16x6"
JSON_TYPE = {"Content-Type": "application/json"}
PATCH_TYPE = {"Content-Type": "application/merge-patch+json"}
IMAGE = {"image": {"width": 64, "height": 48}}


def get(*targets, **headers):
    return [("GET", target, {key.replace("_", "-"): value for key, value in headers.items()}, None)
            for target in targets]


def post(target, value, kind=None, method="POST", **headers):
    body = value if isinstance(value, str) else json.dumps(value)
    return [(method, target, {**(kind or JSON_TYPE),
                              **{key.replace("_", "-"): text for key, text in headers.items()}},
             body)]


def view(**keys):
    return {"dataset": ONE, **IMAGE, **keys}


FRAME = f"/v1/datasets/{ONE}/frame"
FIELDS = f"/v1/datasets/{CLIMATE}/fields"

REQUESTS = [
    # documents
    *get("/v1", "/v1/datasets", f"/v1/datasets/{ONE}", f"/v1/datasets/{CLIMATE}",
         "/v1/datasets/efield:16x16x16", "/v1/colormaps", "/v1/presets", "/view.schema.json",
         "/livez", "/readyz", "/metrics"),
    *get("/v1/datasets/none", "/v1/none", "/none", "/v1/", "/v1//datasets", "/%2e%2e/etc/passwd",
         "/v1?x=1", "/v1/datasets?steps=1"),
    ("HEAD", "/v1", {}, None), ("OPTIONS", "/v1/frames", {}, None), ("OPTIONS", "*", {}, None),
    ("DELETE", "/v1", {}, None), ("TRACE", "/v1", {}, None), ("PUT", "/v1/frames", {}, "{}"),
    # pictures with GET
    *get(*(f"{FRAME}.{kind}?width=64&height=48" for kind in ("jpg", "png", "npy"))),
    *get(f"{FRAME}.png?width=64&height=48&azimuth=30&elevation=40&zoom=1.5",
         f"{FRAME}.png?width=64&height=48&preset=streaks",
         f"/v1/datasets/{CLIMATE}/frame.png?width=64&height=48&step=1",
         f"{FRAME}.gif", f"{FRAME}.png?width=0", f"{FRAME}.png?width=99999&height=99999",
         f"{FRAME}.png?foo=1", f"{FRAME}.png?width=64&width=65", f"{FRAME}.png?azimuth=x",
         f"{FRAME}.png?step=99", "/v1/datasets/none/frame.jpg"),
    *get(f"{FRAME}.jpg?width=64&height=48", Accept="image/png"),
    # pictures with POST
    *post("/v1/frames", view(), Accept="image/png"),
    *post("/v1/frames", view(scalars=[]), Accept="application/x-npy"),
    *post("/v1/frames", view(vector={"field": None}), Accept="image/png"),
    *post("/v1/frames", view(method={"name": "kernel"}), Accept="image/png"),
    *post("/v1/frames", view(method={"name": "slab", "compositing": "cd"}), Accept="image/png"),
    *post("/v1/frames", {"dataset": CLIMATE, **IMAGE, "geometry": {"mapping": "sphere"}},
          Accept="image/png"),
    *post("/v1/frames", {"dataset": CLIMATE, **IMAGE, "step": 1}, Accept="image/png"),
    *post("/v1/frames", view(quality={"maxError": 0.9}), Accept="image/png"),
    *post("/v1/frames", view(), Accept="text/html"),
    # refusals of views
    *post("/v1/frames", ""), *post("/v1/frames", "{"), *post("/v1/frames", "[]"),
    *post("/v1/frames", '{"dataset":"a","dataset":"b"}'), *post("/v1/frames", "{}"),
    *post("/v1/frames", view(foo=1)), *post("/v1/frames", view(step=-1)),
    *post("/v1/frames", view(step=3000000000)), *post("/v1/frames", view(step=99)),
    *post("/v1/frames", view(camera={"eye": [0, 0]})),
    *post("/v1/frames", view(camera={"eye": [0, 0, 0], "target": [0, 0, 0]})),
    *post("/v1/frames", view(vector={"field": "none"})),
    *post("/v1/frames", view(scalars=[{"field": "none"}])),
    *post("/v1/frames", view(vector={"color": {"map": "none"}})),
    *post("/v1/frames", view(method={"name": "reference"})),
    *post("/v1/frames", view(geometry={"slice": {"axis": "z", "index": 99}})),
    *post("/v1/frames", {"dataset": "none"}), *post("/v1/frames", "x" * 70000),
    *post("/v1/frames", view(), {"Content-Type": "text/plain"}),
    # values
    *get(f"/v1/datasets/{CLIMATE}/probe?x=0&y=0&z=0", f"/v1/datasets/{CLIMATE}/probe?x=0&y=0",
         f"/v1/datasets/{CLIMATE}/probe?x=9&y=9&z=9", f"/v1/datasets/{CLIMATE}/probe?x=a&y=0&z=0",
         f"{FIELDS}/cloud/histogram?bins=8", f"{FIELDS}/cloud/histogram?bins=0",
         f"{FIELDS}/cloud/range?of=step", f"{FIELDS}/cloud/range?of=all",
         f"{FIELDS}/cloud/series?x=0&y=0&z=0", f"{FIELDS}/none/histogram", f"{FIELDS}/cloud/none"),
    # the stream's path without an upgrade
    *get("/v1/stream"),
    # saved views
    *post("/v1/views", {"dataset": ONE, "scalars": []}), *get("/v1/views/{view}"),
    ("GET", "/v1/views/{view}", {"If-None-Match": "{etag}"}, None),
    *post("/v1/views/{view}", {"step": 0}, PATCH_TYPE, "PATCH"),
    *post("/v1/views/{view}", {"step": -1}, PATCH_TYPE, "PATCH"),
    *post("/v1/views/{view}", {"dataset": ONE}, method="PUT", If_Match='"other"'),
    *post("/v1/views/{view}", {"dataset": ONE}, method="PUT", If_Match="{etag}"),
    ("DELETE", "/v1/views/{view}", {}, None), *get("/v1/views/{view}", "/v1/views/none"),
    *post("/v1/views", {"foo": 1}),
    # datasets and jobs
    *post("/v1/datasets", {"path": "../etc/passwd"}), *post("/v1/datasets", {"path": "none.nc"}),
    *post("/v1/datasets", {}), *get("/v1/jobs/none", "/v1/references/none.png"),
    ("DELETE", f"/v1/datasets/{ONE}?forget=true", {}, None),
    ("DELETE", f"/v1/datasets/{ONE}", {}, None), ("DELETE", "/v1/datasets/none", {}, None),
]
