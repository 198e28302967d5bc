#include "kerf/base/journal.h"

#include <gtest/gtest.h>

#include "kerf/base/ids.h"
#include "kerf/base/random.h"

namespace kerf::journal_test {
namespace {

struct Tag;
using I = Id<Tag>;

struct TwoArrays {
  Journaled<I, int> a;
  Journaled<I, double> b;
  template <class F>
  void for_each_array(F&& f) {
    f(a);
    f(b);
  }
};

void scribble(TwoArrays& t, Random& random, int writes) {
  for (int i = 0; i < writes; ++i) {
    if (t.a.size() == 0 || random.index(3) == 0) {
      t.a.push_back(random.index(100));
      t.b.push_back(random.uniform());
    } else {
      t.a.set(I(static_cast<std::int32_t>(random.index(static_cast<int>(t.a.size())))), random.index(100));
      t.b.set(I(static_cast<std::int32_t>(random.index(static_cast<int>(t.b.size())))), random.uniform());
    }
  }
}

TEST(Journal, RollbackRestoresEveryNestedMark) {
  Random random(1);
  for (int round = 0; round < 50; ++round) {
    TwoArrays t;
    scribble(t, random, 20);
    std::vector<JournalMark> marks;
    std::vector<std::pair<std::vector<int>, std::vector<double>>> copies;
    for (int level = 0; level < 5; ++level) {
      marks.emplace_back();
      journal_mark(t, marks.back());
      copies.emplace_back(t.a.raw(), t.b.raw());
      scribble(t, random, 15);
    }
    for (int level = 5; level-- > 0;) {
      journal_rollback(t, marks[static_cast<std::size_t>(level)]);
      EXPECT_EQ(t.a.raw(), copies[static_cast<std::size_t>(level)].first);
      EXPECT_EQ(t.b.raw(), copies[static_cast<std::size_t>(level)].second);
      scribble(t, random, 3);  // the log goes on working from a mark that was rolled back to
      journal_rollback(t, marks[static_cast<std::size_t>(level)]);
      EXPECT_EQ(t.a.raw(), copies[static_cast<std::size_t>(level)].first);
    }
  }
}

// A stroke that writes to the same items for a long time needs no more memory than the items.
TEST(Journal, LongLogsAreCompactedAndUndoIsTheSame) {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    TwoArrays t;
    scribble(t, random, 300);
    JournalMark start, since;
    journal_mark(t, start);
    const auto before = std::pair(t.a.raw(), t.b.raw());
    int compactions = 0;
    for (int pass = 0; pass < 200; ++pass) {
      for (int i = 0; i < 20; ++i)
        t.a.set(I(static_cast<std::int32_t>(random.index(static_cast<int>(t.a.size())))), random.index(100));
      if (pass % 10 == 0) scribble(t, random, 5);
      compactions += journal_compact(t, start) ? 1 : 0;
      journal_mark(t, since);
      // The newest mark works as ever.
      const auto here = std::pair(t.a.raw(), t.b.raw());
      scribble(t, random, 7);
      journal_rollback(t, since);
      EXPECT_TRUE(here == std::pair(t.a.raw(), t.b.raw()));
    }
    EXPECT_GT(compactions, 3);
    const auto after = std::pair(t.a.raw(), t.b.raw());
    TwoArrays other = t;
    journal_rollback(other, start);
    EXPECT_TRUE(before == std::pair(other.a.raw(), other.b.raw()));
    JournalStep step = journal_take(t, start);
    EXPECT_LE(step.arrays[0].indices.size(), 3 * before.first.size());  // of 4,000 writes
    for (int again = 0; again < 2; ++again) {
      journal_undo(t, step);
      EXPECT_TRUE(before == std::pair(t.a.raw(), t.b.raw()));
      journal_redo(t, step);
      EXPECT_TRUE(after == std::pair(t.a.raw(), t.b.raw()));
    }
  }
}

TEST(Journal, UndoAndRedoOfSegmentsRestoreTheBits) {
  Random random(2);
  Journaled<I, int> a;
  for (int i = 0; i < 10; ++i) a.push_back(i);
  std::vector<JournalSegment> segments;
  std::vector<std::vector<int>> states{a.raw()};
  for (int cut = 0; cut < 8; ++cut) {
    const auto mark = a.mark();
    for (int i = 0; i < 12; ++i) {
      if (random.index(2)) a.push_back(random.index(1000));
      else a.set(I(static_cast<std::int32_t>(random.index(static_cast<int>(a.size())))), random.index(1000));
      if (i == 5) (void)a.mark();  // a provisional mark inside the stroke
    }
    segments.push_back(a.take_segment(mark));
    states.push_back(a.raw());
  }
  for (std::size_t i = 8; i-- > 3;) {
    a.undo(segments[i]);
    EXPECT_EQ(a.raw(), states[i]);
  }
  for (std::size_t i = 3; i < 8; ++i) {
    a.redo(segments[i]);
    EXPECT_EQ(a.raw(), states[i + 1]);
  }
  for (std::size_t i = 8; i-- > 0;) {
    a.undo(segments[i]);
    EXPECT_EQ(a.raw(), states[i]);
  }
}

}  // namespace
}  // namespace kerf::journal_test
