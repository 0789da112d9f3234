// The server's problems in the words of the page.
import { ProblemError, type Problem } from "@windsplat/client";
import { entryText } from "./key_words";
import { countedFromOne } from "./step_text";

export function problemText(problem: Problem): string {
  const details = problem.errors?.map(({ pointer, detail }) => entryText(pointer, detail));
  // The detail often repeats the first entry; the complete list is more useful.
  if (details !== undefined && details.length > 0) return countedFromOne(details.join("; "));
  return countedFromOne(problem.detail || problem.title || "");
}

// Message of a failed promise.
export function failureText(failure: unknown): string {
  if (failure instanceof ProblemError && failure.problem !== null) {
    return problemText(failure.problem) || failure.message;
  }
  return failure instanceof Error ? failure.message : String(failure);
}
