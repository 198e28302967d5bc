// Which parts of a buffer changed.

/** Half-open range of records. */
export interface Range {
  start: number;
  end: number;
}

/** Changed records nearer than this are sent as one range: fewer calls, few bytes more. */
export const kMergeGap = 256;

/**
 * The least list of ranges that covers all ids (ascending) and [appended, total), where gaps of less than `gap` records
 * are closed. Never contains an empty range: WebGL takes length 0 for "to the end".
 */
export function changedRanges(ids: ArrayLike<number>, appended: number, total: number, gap = kMergeGap): Range[] {
  const ranges: Range[] = [];
  let last: Range | undefined;
  const add = (start: number, end: number): void => {
    if (end <= start) return;
    if (last && start - last.end < gap) last.end = Math.max(last.end, end);
    else ranges.push((last = { start, end }));
  };
  for (let i = 0; i < ids.length; i++) add(ids[i]!, ids[i]! + 1);
  add(appended, total);
  return ranges;
}
