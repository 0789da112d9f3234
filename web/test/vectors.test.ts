// The shared protocol vectors, checked with the page's parsers and the schemas. The C++ tests read
// the same files.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { Ajv2020, type ErrorObject } from "ajv/dist/2020.js";
import {
  encodeClientMessage,
  parseFrame,
  parseFrameHeader,
  parseServerMessage,
  WireError,
  type ClientMessage,
} from "@windsplat/client";

interface Case {
  kind: string;
  description: string;
  document?: unknown;
  text?: string;
  bytes?: string;
  shape?: string;
  pointer?: string;
  schema?: boolean;
  hex?: string;
  fields?: Record<string, unknown>;
}

// Tests run in web/ (scripts/test.mjs).
const protocol = join(process.cwd(), "..", "protocol");
const readJson = (path: string): unknown => JSON.parse(readFileSync(path, "utf8"));

function cases(folder: "valid" | "invalid", kind: string): Case[] {
  const names = readdirSync(join(protocol, "vectors", folder));
  const all = names.flatMap((name) => readJson(join(protocol, "vectors", folder, name)) as Case[]);
  const found = all.filter((one) => one.kind === kind);
  assert.ok(found.length > 0, `no ${folder} vectors of kind ${kind}`);
  return found;
}

const ajv = new Ajv2020({ strict: false, allErrors: true });
ajv.addSchema(readJson(join(protocol, "view.schema.json")) as object, "view.schema.json");
ajv.addSchema(readJson(join(protocol, "messages.schema.json")) as object, "messages.schema.json");

function validator(kind: string, shape?: string) {
  const reference =
    kind === "view" ? "view.schema.json" : `messages.schema.json#/$defs/${shape ?? kind}`;
  const validate = ajv.getSchema(reference);
  assert.ok(validate, `no schema ${reference}`);
  return validate;
}

const escapeKey = (key: string): string => key.replaceAll("~", "~0").replaceAll("/", "~1");

// A validator reports a missing or unknown key at the parent of the key.
function pointerOf(error: ErrorObject): string {
  const { additionalProperty, missingProperty } = error.params as Record<string, string>;
  const key = additionalProperty ?? missingProperty;
  return key === undefined ? error.instancePath : `${error.instancePath}/${escapeKey(key)}`;
}

const documentOf = (one: Case): unknown =>
  one.document === undefined ? JSON.parse(one.text ?? "") : one.document;

const bytesOf = (hex: string): Uint8Array =>
  Uint8Array.from(Buffer.from(hex.replaceAll(" ", ""), "hex"));

for (const kind of ["view", "clientMessage", "serverMessage"]) {
  test(`valid ${kind} vectors match the schema`, () => {
    for (const one of cases("valid", kind)) {
      if (one.schema === false || one.bytes !== undefined) continue;
      const validate = validator(kind, one.shape);
      assert.ok(
        validate(documentOf(one)),
        `${one.description}: ${ajv.errorsText(validate.errors)}`,
      );
    }
  });

  test(`invalid ${kind} vectors fail at their pointer`, () => {
    let asked = 0;
    for (const one of cases("invalid", kind)) {
      if (one.schema === false || one.bytes !== undefined) continue;
      asked += 1;
      const validate = validator(kind, one.shape);
      assert.ok(!validate(documentOf(one)), one.description);
      const pointers = (validate.errors ?? []).map(pointerOf);
      if (one.pointer !== undefined) {
        assert.ok(
          pointers.includes(one.pointer),
          `${one.description}: ${one.pointer} not in ${pointers}`,
        );
      }
    }
    assert.ok(asked > 0);
  });
}

test("the page accepts every valid server message", () => {
  for (const one of cases("valid", "serverMessage")) {
    if (one.shape !== undefined) continue;
    const text = one.text ?? JSON.stringify(one.document);
    assert.deepEqual(parseServerMessage(text), JSON.parse(text), one.description);
  }
});

test("the page refuses server messages of unknown or no type", () => {
  for (const text of [
    "",
    "{",
    "[]",
    "null",
    "7",
    '"hello"',
    "{}",
    '{"type": 1}',
    '{"type": "reboot"}',
    '{"type": "toString"}',
    '{"type": "__proto__"}',
    '{"type": "hello"}',
    '{"type": "opened", "id": 1, "dataset": null}',
    '{"type": "error", "problem": "x"}',
  ]) {
    assert.throws(() => parseServerMessage(text), WireError, text);
  }
});

test("client messages of the page match the vectors", () => {
  for (const one of cases("valid", "clientMessage")) {
    const document = documentOf(one) as ClientMessage;
    const again: unknown = JSON.parse(encodeClientMessage(document));
    assert.ok(validator("clientMessage")(again), one.description);
    assert.deepEqual(again, document);
  }
});

test("valid frame headers have their field values", () => {
  for (const one of cases("valid", "frameHeader")) {
    const header = parseFrameHeader(bytesOf(one.hex!));
    const fields = one.fields!;
    const codes = { jpeg: 1, png: 2, h264: 3 };
    const methods = { kernel: 1, slab: 2, reference: 3 };
    const orNull = (value: number) => (Number.isNaN(value) ? null : value);
    const {
      magic: _magic,
      version: _version,
      kind: _kind,
      headerLen: _headerLen,
      ...rest
    } = fields;
    assert.deepEqual(
      {
        seq: header.seq,
        rev: header.rev,
        step: header.step,
        flags: header.flags,
        width: header.width,
        height: header.height,
        codec: codes[header.codec],
        quality: header.quality,
        method: methods[header.method],
        level: header.level,
        error: orNull(header.error),
        jpegError: orNull(header.jpegError),
        queueUs: header.queueUs,
        renderUs: header.renderUs,
        encodeUs: header.encodeUs,
        payloadBytes: header.payloadBytes,
        t: header.t,
      },
      rest,
      one.description,
    );
    const flags = Number(fields.flags);
    assert.equal(header.final, flags % 2 === 1);
    assert.equal(header.errorMeasured, Math.floor(flags / 2) % 2 === 1);
  }
});

test("invalid frame headers are refused", () => {
  for (const one of cases("invalid", "frameHeader")) {
    assert.throws(() => parseFrameHeader(bytesOf(one.hex!)), WireError, one.description);
  }
});

test("a frame whose picture length differs from its header is refused", () => {
  const header = bytesOf(cases("valid", "frameHeader")[0]!.hex!);
  const size = new DataView(header.buffer).getUint32(52, true);
  for (const extra of [-1, 0, 1]) {
    const message = new Uint8Array(64 + size + extra);
    message.set(header);
    if (extra === 0) {
      assert.equal(parseFrame(message.buffer).picture.byteLength, size);
    } else {
      assert.throws(() => parseFrame(message.buffer), WireError);
    }
  }
});
