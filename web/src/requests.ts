// Views that are posted to the server, and what it says when it refuses.
import type { Problem, View } from "./protocol";
import { problemText } from "./status";

export const posted = (view: View, headers = {}): RequestInit => ({
  method: "POST",
  headers: { "Content-Type": "application/json", ...headers },
  body: JSON.stringify(view),
});

// What a server that refused says, in its own words.
export async function refusalText(response: Pick<Response, "status" | "json">): Promise<string> {
  const problem = (await response.json().catch(() => null)) as Problem | null;
  return (problem && problemText(problem)) || `The server answered with HTTP ${response.status}.`;
}

export const notUnderstood = "The server's answer could not be understood.";
