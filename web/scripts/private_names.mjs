// TypeScript sources -> JavaScript with every private member's name marked, so that the bundler may
// shorten it: what is private to a class has no name outside. Found by the compiler's own symbols,
// not by spelling.
import ts from "typescript";
import { checkUses } from "./lean_gui.mjs";

const mark = (name) => `$private_${name}`;

const isPrivate = (symbol) =>
  symbol?.declarations?.some(
    (declaration) => ts.getCombinedModifierFlags(declaration) & ts.ModifierFlags.Private,
  ) ?? false;

// Places and texts that replace the names there.
function edits(source, checker) {
  const found = [];
  const visit = (node) => {
    ts.forEachChild(node, visit);
    if (!ts.isIdentifier(node)) return;
    const { parent, text } = node;
    const put = (replacement) => found.push([node.getStart(source), node.end, replacement]);
    // `private x` of a constructor is a parameter as well, which has no name of a member.
    if (ts.isParameter(parent) && parent.name === node && parent.modifiers !== undefined) {
      if (isPrivate(checker.getSymbolAtLocation(node))) put(mark(text));
      return;
    }
    if (ts.isBindingElement(parent) && parent.name === node && !parent.propertyName) {
      const from = checker.getTypeAtLocation(parent.parent).getProperty(text);
      if (ts.isObjectBindingPattern(parent.parent) && isPrivate(from)) {
        put(`${mark(text)}: ${text}`);
      }
      return;
    }
    if (isPrivate(checker.getSymbolAtLocation(node))) put(mark(text));
  };
  visit(source);
  return found.sort(([a], [b]) => b - a);
}

const output = {
  target: ts.ScriptTarget.ES2022,
  module: ts.ModuleKind.ESNext,
  verbatimModuleSyntax: true,
  useDefineForClassFields: false,
};

// File name -> text.
export function withMarkedPrivates(entry) {
  const options = { target: ts.ScriptTarget.ES2022, moduleResolution: 100, strict: true };
  const program = ts.createProgram([entry], options);
  const checker = program.getTypeChecker();
  const texts = new Map();
  for (const source of program.getSourceFiles()) {
    if (source.isDeclarationFile || source.fileName.includes("node_modules")) continue;
    checkUses(source, checker);
    let { text } = source;
    for (const [from, to, name] of edits(source, checker)) {
      text = text.slice(0, from) + name + text.slice(to);
    }
    texts.set(source.fileName, ts.transpileModule(text, { compilerOptions: output }).outputText);
  }
  return texts;
}
