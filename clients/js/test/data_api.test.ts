// Uploads and arrays of values with a simulated server: requests, and what is no answer.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Client, ProblemError } from "../src/index";

const received = {
  ...{ id: "a b.nc", bytes: 3, expires: "2026-01-01T14:00:00Z" },
  digest: `sha-256=:${"A".repeat(43)}=:`,
};
const axisOf = (name: string, count: number) => ({
  ...{ name, units: "m", index: 0, stride: 2, count, first: 0, last: 10 },
});
const told = {
  ...{ field: "wind", step: 1, time: { value: 6, text: "6 h" }, units: "m s-1" },
  dims: ["y", "x"],
  shape: [2, 3],
  axes: { x: axisOf("x", 3), y: axisOf("y", 2), z: axisOf("z", 1) },
};

// A file of NPY whose description is `text`.
function npy(text: string, numbers: number[]): Uint8Array<ArrayBuffer> {
  const file = new Uint8Array(10 + text.length + 4 * numbers.length);
  file.set(Buffer.from(`\x93NUMPY\x01\x00`, "latin1"));
  const data = new DataView(file.buffer);
  data.setUint16(8, text.length, true);
  file.set(Buffer.from(text), 10);
  for (const [n, one] of numbers.entries()) data.setFloat32(10 + text.length + 4 * n, one, true);
  return file;
}
const floats = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";

function serverOf(answer: () => Response) {
  const asked: { call: string; init: RequestInit }[] = [];
  const fetch = (url: string, init: RequestInit) => {
    asked.push({
      call: `${init.method ?? "GET"} ${url.replace("http://host/base/v1/", "")}`,
      init,
    });
    return Promise.resolve(answer());
  };
  return { asked, client: new Client("http://host/base/", { fetch, token: "t" }) };
}

test("an upload is sent as it is, with its digest, its end and the token", async () => {
  const { asked, client } = serverOf(() => Response.json(received, { status: 201 }));
  const { digest } = received;
  assert.deepEqual(await client.upload("a b.nc", "abc", { keep: 60, digest }), received);
  const [{ call, init }] = asked as [(typeof asked)[0]];
  assert.equal(call, "PUT uploads/a%20b.nc?keep=60");
  assert.equal(init.body, "abc");
  assert.deepEqual(init.headers, {
    Authorization: "Bearer t",
    "Content-Type": "application/octet-stream",
    "Content-Digest": digest,
  });
  const bytes = new Uint8Array([1, 2, 3]);
  for (const body of [bytes, bytes.buffer, new Blob([bytes])]) await client.upload("b", body);
  assert.deepEqual(await client.uploaded("b"), received);
  assert.deepEqual(
    asked.slice(1).map((one) => one.call),
    [...Array(3).fill("PUT uploads/b?"), "GET uploads/b"],
  );
});

test("a body of unknown length and an upload without a name are not sent", async () => {
  const { asked, client } = serverOf(() => Response.json(received));
  const stream = new Blob(["abc"]).stream() as unknown as Blob;
  const refused = { name: "TypeError", message: /^body must be a Blob, an ArrayBuffer, a Uint8/ };
  await assert.rejects(client.upload("a", stream), refused);
  for (const asks of [() => client.uploaded(""), () => client.openUpload("")]) {
    await assert.rejects(async () => asks(), { name: "TypeError", message: /^id must be a name/ });
  }
  assert.deepEqual(asked, []);
});

test("values are numbers with the description of the server", async () => {
  const headers = { "Windsplat-Values": JSON.stringify(told) };
  const file = npy(floats, [1, 2.5, NaN, -4, 5, 6]);
  const { asked, client } = serverOf(() => new Response(file, { headers }));
  const box = { bbox: [-20, 30, 40, 70], stride: [2, 2, 1], minusStep: 0 } as const;
  const { values, ...rest } = await client.values("gcm", "wind", {
    ...{ ...box, bbox: [...box.bbox], stride: [...box.stride] },
    ...{ level: [1000, 500], datetime: "2001-01-01", nearest: true, minus: "other" },
  });
  assert.deepEqual(values, new Float32Array([1, 2.5, NaN, -4, 5, 6]));
  assert.deepEqual(rest, told);
  const query = new URL(asked[0]!.call.slice("GET ".length), "http://host").searchParams;
  assert.deepEqual(Object.fromEntries(query), {
    ...{ bbox: "-20,30,40,70", level: "1000,500", datetime: "2001-01-01", nearest: "true" },
    ...{ stride: "2,2,1", minus: "other", minusStep: "0" },
  });
  assert.match(asked[0]!.call, /^GET datasets\/gcm\/fields\/wind\/values\.npy\?/);
});

test("an array that is cut, of another type, or not as described is none", async () => {
  const numbers = [1, 2, 3, 4, 5, 6];
  const good = npy(floats, numbers);
  const headers = { "Windsplat-Values": JSON.stringify(told) };
  const other = { "Windsplat-Values": JSON.stringify({ ...told, shape: [3, 2] }) };
  const wrong: [string, Uint8Array<ArrayBuffer>, HeadersInit][] = [
    ["cut", good.slice(0, -1), headers],
    ["empty", good.slice(0, 0), headers],
    ["no array", new Uint8Array(Buffer.from("a text and no array")), headers],
    ["columns first", npy(floats.replace("False", "True"), numbers), headers],
    ["integers", npy(floats.replace("<f4", "<i4"), numbers), headers],
    ["not described", good, {}],
    ["another shape", good, other],
  ];
  for (const [what, file, sent] of wrong) {
    const { client } = serverOf(() => new Response(file, { headers: sent }));
    await assert.rejects(client.values("gcm", "wind"), /could not be understood/, what);
  }
  const { client } = serverOf(() =>
    Response.json({ title: "No", detail: "64 MiB" }, { status: 422 }),
  );
  const error = await client.values("gcm", "wind").catch((one: unknown) => one);
  assert.ok(error instanceof ProblemError);
  assert.deepEqual([error.status, error.message], [422, "64 MiB"]);
});
