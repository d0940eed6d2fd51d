#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "layfigure/doll/settings.h"

namespace layfigure::doll::test {

/// A settings file of its own for the running test.
class SettingsFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string(test->test_suite_name()) + "_" + test->name() + "_" + std::to_string(::getpid()) + ".toml");
  }
  void TearDown() override { std::filesystem::remove_all(path_); }

  [[nodiscard]] DollSettings load(const std::string& text) const {
    std::ofstream(path_) << text;
    return load_settings(path_);
  }

  /// What `action` says; fails unless that is a SettingsError of one line that names the file.
  template <class Action>
  [[nodiscard]] std::string complaint_of(Action action) const {
    try {
      action();
    } catch (const SettingsError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find(path_.string()), std::string::npos) << what;
      EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 0) << what;
      return what;
    }
    ADD_FAILURE() << "accepted";
    return {};
  }

  /// What loading the text says.
  [[nodiscard]] std::string complaint(const std::string& text) const {
    SCOPED_TRACE(text);
    return complaint_of([&] { (void)load(text); });
  }

  std::filesystem::path path_;
};

}  // namespace layfigure::doll::test
