// Times in a readable form.

// 2001-01-01T03:00:00Z -> 2001-01-01 03:00Z; any other text is unchanged.
export function readableTime(text: string): string {
  const parts = /^(\d{4,}-\d\d-\d\d)T(\d\d:\d\d)(?::00(?:\.0+)?)?(:\d\d)?(Z?)$/.exec(text);
  if (parts === null) return text;
  return `${parts[1]} ${parts[2]}${parts[3] ?? ""}${parts[4]}`;
}
