// The benchmarks' own behaviour: their files, their page, and that they still run. What they measure is no business of a test.
#include <gmock/gmock.h>

#include "bench/bench_bodies.h"
#include "bench/bench_table.h"
#include "bench/benchmarks.h"
#include "bench/session_timing.h"

namespace kerf::bench::bench_test {
namespace {

using testing::HasSubstr;

Run some_run() {
  Run run;
  run.program = "kerf bench paper";
  run.machine = {{"processor", "a fast one"}, {"date", "today"}};
  run.tables = {{"t",
                 "A table",
                 "With a note.",
                 {"what", "value, ms"},
                 {{"say \"x\", y", 0.25}, {"none", Cell()}, {"count", 53633.0}}}};
  run.figures = {{"t-plot", "a caption", {}}};
  return run;
}

TEST(Bench, NumbersForPeople) {
  EXPECT_EQ(cell_text(53633.0), "53,633");
  EXPECT_EQ(cell_text(-1234567.0), "-1,234,567");
  EXPECT_EQ(cell_text(999.0), "999");
  EXPECT_EQ(cell_text(0.25), "0.250");
  EXPECT_EQ(cell_text(1234.56), "1,235");
  EXPECT_EQ(cell_text(0.00123), "0.00123");
  EXPECT_EQ(cell_text(12.34), "12.3");
  EXPECT_EQ(cell_text(Cell()), "");
  EXPECT_EQ(cell_text(std::nan("")), "-");
}

TEST(Bench, JsonComesBack) {
  const bench::Run run = some_run();
  const auto back = parse_run(run_json(run), "file");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(run_json(*back), run_json(run));
  EXPECT_EQ(back->machine, run.machine);
  for (const char* bad : {"", "[]", "{}", "{\"kerf_bench\": 7}", "{\"kerf_bench\": "}) {
    const auto refused = parse_run(bad, "file");
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_THAT(refused.error().message, HasSubstr("file"));
  }
  // Keys of the wrong kind are left out.
  EXPECT_TRUE(
      parse_run(R"({"kerf_bench": 1, "machine": 3, "tables": [4, {"rows": [[{}, 1]], "id": 9}], "figures": [1]})",
                "file")
          .ok());
}

TEST(Bench, CsvQuotesAndPage) {
  const bench::Run run = some_run();
  EXPECT_EQ(csv(run.tables[0]), "what,\"value, ms\"\n\"say \"\"x\"\", y\",0.25\nnone,\ncount,53633\n");
  const std::string page = results_page({run}, "results");
  for (const char* part :
       {"a fast one", "kerf bench paper", "| count | 53,633 |", "![a caption](results/t-plot.svg)", "With a note."})
    EXPECT_THAT(page, HasSubstr(part));
}

TEST(Bench, EveryTableOfThePaper) {
  BenchOptions options;
  options.quick = true;
  const auto run = bench_paper(options, {});
  ASSERT_TRUE(run.ok()) << run.error().message;
  std::vector<std::string> ids;
  for (const Table& table : run->tables) {
    ids.push_back(table.id);
    EXPECT_FALSE(table.rows.empty()) << table.id;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.columns.size()) << table.id;
  }
  EXPECT_THAT(ids, testing::ElementsAre("table-1", "table-2", "figure-16", "table-3", "table-4", "table-5", "table-6",
                                        "section-5.3-binding", "section-5.3-sizes", "section-5.3", "haptic", "sofa"));
}

TEST(Bench, EveryTableOfScale) {
  BenchOptions options;
  options.quick = true;
  std::size_t kept = 0;
  options.kept = [&](const bench::Run& so_far) -> Status {
    EXPECT_EQ(so_far.tables.size(), ++kept);
    EXPECT_FALSE(so_far.machine.empty());
    return {};
  };
  const auto run = bench_scale(options, {});
  ASSERT_TRUE(run.ok()) << run.error().message;
  ASSERT_EQ(run->tables.size(), 8U);
  EXPECT_EQ(kept, 8U);
  for (const Table& table : run->tables) {
    EXPECT_FALSE(table.rows.empty()) << table.id;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.columns.size()) << table.id;
  }
  const Table& cuts = run->tables[5];
  for (const auto& row : cuts.rows) EXPECT_EQ(row.back().text, "hold");
  for (const auto& row : run->tables[6].rows) {  // strokes, then nothing that is wrong
    EXPECT_TRUE(row[1].number == 5 && row[4].number == 0 && row[5].number == 0 && row[6].number == 0 &&
                row[12].text.starts_with("0 of"));
    EXPECT_LT(std::stod(row[8].text), 1e-6) << "walls outside the body, edges";
    EXPECT_LT(std::stod(row[9].text), 1e-4) << "surface through itself, edges";
    EXPECT_LT(std::stod(row[10].text), 0.5) << "walls off the swept surface, edges; blades lean by up to 35 degrees";
    if (row[11].text == "-") continue;
    EXPECT_LT(std::stod(row[11].text), 0.2) << "swept places without a wall, edges";
  }
  const Table& threads = run->tables[7];
  EXPECT_EQ(threads.rows[0].back().text, threads.rows[1].back().text);
  EXPECT_EQ(threads.rows[2].back().text, threads.rows[3].back().text);
}

TEST(Bench, CutsAreUndoneAndCounted) {
  auto session = bench_session({"closed-sheet", 2000, 104});
  ASSERT_TRUE(session.ok());
  const std::uint64_t before = body_hash(session->body());
  const auto timings = time_cuts(*session, 5);
  ASSERT_TRUE(timings.ok());
  EXPECT_EQ(timings->whole.values.size(), 5U);
  EXPECT_GT(timings->triangles, 6);
  EXPECT_EQ(body_hash(session->body()), before);
  ASSERT_TRUE(time_short_cuts(*session, 2, 0.3, 1).ok());
  EXPECT_NE(body_hash(session->body()), before);
  EXPECT_EQ(session->undo_depth(), 2);
}

TEST(Bench, Quantiles) {
  Sample sample;
  EXPECT_EQ(sample.quantile(0.5), 0);
  for (int i = 100; i >= 1; --i) sample.add(i);
  EXPECT_EQ(sample.median(), 50);
  EXPECT_EQ(sample.quantile(0.99), 99);
  EXPECT_EQ(sample.quantile(1), 100);
  EXPECT_EQ(sample.quantile(0.001), 1);
}

}  // namespace
}  // namespace kerf::bench::bench_test
