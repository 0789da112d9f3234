// A simulated server for the tests of requests.
import type { FetchLike } from "@windsplat/client/parts";

export const problem = (status: number, detail: string, headers: Record<string, string> = {}) =>
  new Response(JSON.stringify({ type: "about:blank", title: "No", status, detail }), {
    status,
    headers,
  });

// A server that returns these answers in order.
export function server(...answers: (() => Response)[]) {
  const asked: { url: string; options: RequestInit }[] = [];
  const fetch: FetchLike = (url, options) => {
    asked.push({ url, options });
    return Promise.resolve(answers[Math.min(asked.length, answers.length) - 1]!());
  };
  return { asked, fetch };
}
