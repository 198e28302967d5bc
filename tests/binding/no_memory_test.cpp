// Bound bodies are made, saved and read while memory runs out: every request for memory is refused once, one after the other.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <iterator>
#include <optional>
#include <string>

#include "kerf/base/parallel.h"
#include "kerf/binding/bind.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/whole_file.h"

#include "mesh/temporary_folder.h"
#include "support/counted_new.h"

namespace kerf::no_memory_test {
namespace {

class BoundBodyNoMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto model = make_model("strip", {});
    ASSERT_TRUE(model.ok());
    model_ = *model;
    auto bound = bind(model_.visual, model_.collision, {});
    ASSERT_TRUE(bound.ok());
    path_ = folder_.file("a.kerf");
    ASSERT_TRUE(save_bound_body(*bound, path_).ok());
    bytes_ = bytes_of(path_);
    bound_.emplace(std::move(*bound));
  }
  static std::string bytes_of(const std::string& path) {
    const auto read = read_whole_file(path, kOtherFile);
    return read.ok() ? std::string(read->view()) : read.error().message;
  }
  /// What is in a body, as a file has it.
  [[nodiscard]] std::string file_of(const BoundBody& body) const {
    const test::NothingRefused here;
    const std::string path = folder_.file("b.kerf");
    EXPECT_TRUE(save_bound_body(body, path).ok());
    const std::string bytes = bytes_of(path);
    std::filesystem::remove(path);
    return bytes;
  }

  const ThreadLimit one_{1};
  test::TemporaryFolder folder_;
  Model model_;
  std::optional<BoundBody> bound_;
  std::string path_, bytes_;
};

TEST_F(BoundBodyNoMemory, AFileIsReadOrNamed) {
  const long refusals = test::with_requests_refused(
      0, 1,
      [&] {
        const auto read = load_bound_body(path_);
        const test::NothingRefused here;
        if (read.ok()) {
          EXPECT_EQ(file_of(*read), bytes_);
        } else {
          EXPECT_TRUE(read.error().message.find("a.kerf: not enough memory") != std::string::npos)
              << read.error().message;
        }
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 20);
}

TEST_F(BoundBodyNoMemory, ASaveLeavesTheOldFileOrTheNew) {
  const std::string old = "the old file\n";
  const long refusals = test::with_requests_refused(
      0, 1,
      [&] {
        {
          const test::NothingRefused before;
          ASSERT_TRUE(replace_file(path_, old).ok());
        }
        (void)save_bound_body(*bound_, path_);
      },
      [&](bool refused, bool) {
        const std::string now = bytes_of(path_);
        EXPECT_TRUE(now == old || now == bytes_);
        if (!refused) {
          EXPECT_EQ(now, bytes_);
        }
        const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1) << "something was left beside it";
      });
  EXPECT_GT(refusals, 5);
}

/// Refuses every `step`-th request of a binding. Whatever is refused, it comes out whole or not at all.
void bind_with_refusals(const TriangleMesh& visual, const TriangleMesh& collision, long step,
                        const std::function<void(const BoundBody&)>& check) {
  const long refusals = test::with_requests_refused(
      0, step,
      [&] {
        const auto bound = bind(visual, collision, {});
        const test::NothingRefused here;
        ASSERT_TRUE(bound.ok()) << bound.error().message;
        check(*bound);
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 10);
}

TEST_F(BoundBodyNoMemory, ABindingComesOutWholeOrNotAtAll) {
  bind_with_refusals(model_.visual, model_.collision, 199, [&](const BoundBody& b) { EXPECT_EQ(file_of(b), bytes_); });
}
TEST_F(BoundBodyNoMemory, EveryPartOfABindingCanFail) {
  bind_with_refusals(model_.visual, model_.collision, 7, [&](const BoundBody& b) { EXPECT_EQ(file_of(b), bytes_); });
}

}  // namespace
}  // namespace kerf::no_memory_test
