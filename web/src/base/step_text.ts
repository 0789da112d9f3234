// Steps in the server's texts, which count from 0 as REST does -> counted from 1 as on the page.
export const countedFromOne = (text: string): string =>
  text
    .replace(
      /(\bsteps? )(\d+)(?:( (?:to|and) )(\d+))?\b/g,
      (_, before: string, first: string, between = "", last = "") =>
        before + next(first) + between + (last === "" ? "" : next(last)),
    )
    .replace(
      /(\bname one of )(\d+)( to )(\d+)\b/g,
      (_, before: string, first: string, between: string, last: string) =>
        before + next(first) + between + next(last),
    );

const next = (digits: string): string => String(Number(digits) + 1);
