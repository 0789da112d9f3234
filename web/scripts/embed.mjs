// The built page -> an assembly file that includes the gzipped files, and a C++ file that lists
// them; the page of the study report is embedded likewise, but uncompressed. Used by
// web/embed.cmake.
// Usage: node scripts/embed.mjs OUTDIR
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, extname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { installModules } from "./install.mjs";

const scripts = dirname(fileURLToPath(import.meta.url));
const contentTypes = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript; charset=utf-8",
  ".css": "text/css; charset=utf-8",
  ".svg": "image/svg+xml",
};

function pack(dist, outdir) {
  return readdirSync(dist)
    .filter((name) => !name.endsWith(".gz"))
    .sort()
    .map((name, index) => {
      const gzip = readFileSync(join(dist, `${name}.gz`));
      const path = join(outdir, `asset_${index}.gz`);
      writeFileSync(path, gzip);
      return {
        name,
        path,
        size: gzip.length,
        symbol: `windsplat_web_asset_${index}`,
        digest: createHash("sha256").update(gzip).digest("hex"),
        type: contentTypes[extname(name)],
        immutable: /-[0-9a-f]{10}\.\w+$/.test(name),
      };
    });
}

// The digests change the assembly file whenever an included file changes.
const assembly = (assets) => `/* Made by web/scripts/embed.mjs. */
    .section .rodata
${assets
  .map(
    (asset) => `/* ${asset.name} ${asset.digest} */
    .global ${asset.symbol}
    .hidden ${asset.symbol}
    .balign 16
${asset.symbol}:
    .incbin "${asset.path}"
`,
  )
  .join("")}    .section .note.GNU-stack, "", %progbits
`;

const declaration = (asset) => `extern const std::uint8_t ${asset.symbol}[${asset.size}];\n`;

const entry = ({ name, type, symbol, immutable }) =>
  `      {"${name}", "${type}", ${symbol}, ${immutable}},\n`;

const listing = (assets) => `// Made by web/scripts/embed.mjs from web/dist.
#include <array>

#include "server/api/web_assets.hpp"

extern "C" {
${assets.map(declaration).join("")}}

namespace windsplat::api {

std::span<const WebAsset> web_assets() {
  static const std::array<WebAsset, ${assets.length}> assets = {{
${assets.map(entry).join("")}  }};
  return assets;
}

}  // namespace windsplat::api
`;

const reportAssembly = (path, digest) => `/* Made by web/scripts/embed.mjs. ${digest} */
    .section .rodata
    .global windsplat_report_template
    .hidden windsplat_report_template
windsplat_report_template:
    .incbin "${path}"
    .section .note.GNU-stack, "", %progbits
`;

const reportListing = (size) => `// Made by web/scripts/embed.mjs from web/report.
#include "server/study/report/template.hpp"

extern "C" {
extern const char windsplat_report_template[${size}];
}

namespace windsplat::study {

std::string_view report_template() {
  return {windsplat_report_template, sizeof(windsplat_report_template)};
}

}  // namespace windsplat::study
`;

const outdir = resolve(process.argv[2]);
const dist = join(outdir, "dist");
mkdirSync(dist, { recursive: true });
installModules();
// Run as separate processes, because their modules have only just been installed.
const run = (script, ...args) =>
  execFileSync(process.execPath, [join(scripts, script), ...args], { stdio: "inherit" });
const report = join(outdir, "report.html");
run("build.mjs", "--quiet", "--outdir", dist);
run("report.mjs", report);
const assets = pack(dist, outdir);
writeFileSync(join(outdir, "web_assets.S"), assembly(assets));
writeFileSync(join(outdir, "web_assets.cpp"), listing(assets));
const page = readFileSync(report);
const digest = createHash("sha256").update(page).digest("hex");
writeFileSync(join(outdir, "report_template.S"), reportAssembly(report, digest));
writeFileSync(join(outdir, "report_template.cpp"), reportListing(page.length));
