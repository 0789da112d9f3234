// lil-gui's script and style sheet without what this page never uses. Whatever is to be left out
// and is not where it was fails the build, and so does a use of it: lil-gui's next version, or a
// panel that needs more of it, has to be looked at here.
import ts from "typescript";

// Class -> members that are called neither in src/ nor by what stays.
const members = {
  Controller:
    "onFinishChange _callOnFinishChange reset hide decimals listen _listenCallback load save",
  NumberController: "decimals",
  GUI:
    "load save reset onChange _callOnChange onFinishChange _callOnFinishChange hide " +
    "controllersRecursive addColor",
};

// Statements that call them, and the ways of boxes for words, of
// panels that place themselves and bring their own styles.
const scriptParts = [
  /this\._listenCallback = .*;/,
  /this\.listen\( false \);/,
  /this\.parent\._callOnChange\( this \);/,
  /this\._callOnFinishChange\(\);/g,
  /this\._changed = true;/,
  /const callOnFinishChange[^]*?wheelFinishChangeTimeout;/,
  /clearTimeout\([^]*?WHEEL_DEBOUNCE_TIME \);/,
  /case 'string':[^]*?(?=case 'function')/,
  /console\.error\([^]*?initialValue \);/,
  /var stylesheet = `[^`]*`;/,
  /if \( touchStyles \) \{[^]*?(?=if \( container \))/,
  /(?<=\}) else if \( autoPlace \)[^]*?(?=\}\s*\/\*\*)/,
  /autoPlace = .*,/,
  /width,(?=\s*title)/,
  / = 'Controls',[^]*?(?=\} = \{\})/,
  /if \( this\.root\._closeFolders \).*;/,
];

function withoutMembers(script, path) {
  const source = ts.createSourceFile(path, script, ts.ScriptTarget.ES2022, true);
  const cuts = [];
  for (const [name, list] of Object.entries(members)) {
    const found = source.statements.find(
      (one) => ts.isClassDeclaration(one) && one.name.text === name,
    );
    for (const member of list.split(" ")) {
      const part = found?.members.find((one) => one.name?.text === member);
      if (part === undefined) throw new Error(`${path}: there is no ${name}.${member}`);
      cuts.push([part.pos, part.end]);
    }
  }
  cuts.sort(([a], [b]) => b - a);
  return cuts.reduce((text, [from, to]) => text.slice(0, from) + text.slice(to), script);
}

export function leanScript(script, path) {
  let lean = withoutMembers(script, path);
  for (const part of scriptParts) {
    const before = lean;
    lean = lean.replace(part, "");
    if (lean === before) throw new Error(`${path}: ${part} is not where it was`);
  }
  for (const name of new Set(Object.values(members).flatMap((list) => list.split(" ")))) {
    const called = lean.includes(`this.${name}(`) && !lean.includes(`\t${name}(`);
    if (called) throw new Error(`${path}: ${name} is left out, but called`);
  }
  return lean;
}

// Fails where a source of ours uses what is left out.
export function checkUses(source, checker) {
  const visit = (node) => {
    ts.forEachChild(node, visit);
    if (!ts.isPropertyAccessExpression(node)) return;
    for (const declaration of checker.getSymbolAtLocation(node.name)?.declarations ?? []) {
      const { fileName } = declaration.getSourceFile();
      const list = members[declaration.parent.name?.text] ?? "";
      if (fileName.includes("/lil-gui/") && list.split(" ").includes(node.name.text)) {
        throw new Error(`${source.fileName}: ${node.getText(source)} is left out (lean_gui.mjs)`);
      }
    }
  };
  visit(source);
}

// Rules, by their selectors; at-rules that are left without any go by themselves.
const rules = [
  ".lil-gui.lil-root > .lil-title",
  ".lil-gui.lil-root > .lil-children::-webkit-scrollbar",
  ".lil-gui.lil-root > .lil-children::-webkit-scrollbar-thumb",
  ".lil-gui.lil-allow-touch-styles, .lil-gui.lil-allow-touch-styles .lil-gui",
  ".lil-gui.lil-force-touch-styles, .lil-gui.lil-force-touch-styles .lil-gui",
  ".lil-gui.lil-auto-place, .lil-gui.autoPlace",
  ".lil-controller.lil-string input",
  ".lil-controller.lil-color .lil-display",
  ".lil-controller.lil-color .lil-display:hover:before",
  ".lil-controller.lil-color input[type=color]",
  ".lil-controller.lil-color input[type=text]",
  ".lil-controller.lil-option .lil-display.lil-active",
  ".lil-gui.lil-root > .lil-title:focus",
  ".lil-gui .lil-children:empty:before",
  ".lil-gui .lil-gui .lil-gui > .lil-children",
  "@font-face",
];

// Properties whose values panel.css sets for all of the panel.
const properties =
  "background-color text-color title-background-color title-text-color widget-color hover-color " +
  "focus-color number-color string-color font-size input-font-size font-family font-family-mono " +
  "padding spacing widget-height name-width slider-input-width color-input-width folder-indent " +
  "widget-border-radius scrollbar-width";

export function leanStyle(style, path) {
  const cut = (text, from, to) => {
    if (from < 0 || to < 0) throw new Error(`${path}: not all of it is where it was`);
    return text.slice(0, from) + text.slice(to);
  };
  let lean = style;
  for (const selector of rules) {
    const from = lean.search(new RegExp(`^ *${selector.replace(/[.*()[\]]/g, "\\$&")} \\{`, "m"));
    lean = cut(lean, from, lean.indexOf("}", from) + 1);
  }
  for (const name of properties.split(" ")) {
    const from = lean.indexOf(`  --${name}: `);
    lean = cut(lean, from, lean.indexOf(";", from) + 1);
  }
  // Its signs come as a font in a data: address, which a strict policy for content forbids; the
  // system's fonts have them too.
  return lean.replaceAll('  font-family: "lil-gui";\n', "");
}
