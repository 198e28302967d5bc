// What a benchmark found: tables of numbers and words, plots, and the machine. Written as JSON, CSV and Markdown, and read
// back from JSON, so that the page of results is made of what programs wrote.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kerf/base/result.h"
#include "plot.h"

namespace kerf::bench {

/// Empty, a number or a text.
struct Cell {
  Cell() = default;
  Cell(double value) : number(value), is_number(true) {}
  Cell(std::string words) : text(std::move(words)) {}
  Cell(const char* words) : text(words) {}
  std::string text;
  double number = 0;
  bool is_number = false;
};

struct Table {
  std::string id;  ///< of its CSV file and for --rows: "table-2"
  std::string title;
  std::string note;  ///< a sentence or two: what was done
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;
};

struct Figure {
  std::string id, caption;
  app::Plot plot;
};

/// One run of one benchmark program.
struct Run {
  std::string program;                                       ///< how to repeat it: "kerf bench paper --cuts 100"
  std::vector<std::pair<std::string, std::string>> machine;  ///< as machine_facts()
  std::vector<Table> tables;
  std::vector<Figure> figures;
};

/// A number for people: three significant digits, or all of a count.
std::string cell_text(const Cell& cell);
std::string markdown(const Table& table);
std::string csv(const Table& table);
/// JSON of everything but the plots' points, which are in the tables; figures by id and caption.
std::string run_json(const Run& run);
/// Bad input: not such a file.
Result<Run> parse_run(std::string_view text, std::string_view name);

/// Several runs as one Markdown page: per run the machine, how to repeat it, every table and figure (ID.svg in `pictures`,
/// a path relative to the page).
std::string results_page(const std::vector<Run>& runs, std::string_view pictures);

}  // namespace kerf::bench
