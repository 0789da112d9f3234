// Requests that post a document, and the text of error answers.
import { countedFromOne } from "../base/step_text";
import { entryText } from "../base/key_words";
import type { Problem, View } from "./protocol";

export function problemText(problem: Problem): string {
  const details = problem.errors?.map(({ pointer, detail }) => entryText(pointer, detail));
  // The detail often repeats the first entry; the complete list is more useful.
  if (details !== undefined && details.length > 0) return countedFromOne(details.join("; "));
  return countedFromOne(problem.detail || problem.title || "");
}

export const posted = (body: View | object, headers = {}): RequestInit => ({
  method: "POST",
  headers: { "Content-Type": "application/json", ...headers },
  body: JSON.stringify(body),
});

// The server's own text of an error answer.
export async function refusalText(response: Pick<Response, "status" | "json">): Promise<string> {
  const problem = (await response.json().catch(() => null)) as Problem | null;
  return (problem && problemText(problem)) || `The server answered with HTTP ${response.status}.`;
}

export const notUnderstood = "The server's answer could not be understood.";
