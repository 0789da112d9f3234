// Links to views that the server stores: a view too long for an address <-> `#!view=ID`.

export const linkMax = 2000; // characters; mail and chat programs break longer links

export const shortLinkHash = (id: string): string => `#!view=${encodeURIComponent(id)}`;

// null: not a link to a stored view.
export function shortLinkId(hash: string): string | null {
  const id = /^#!view=([\w.~-]{1,128})$/.exec(hash);
  return id === null ? null : id[1]!;
}
