// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/reporter.h"
#include "runtime/cli/setting_words.h"
#include "runtime/cli/stage_progress.h"
#include "runtime/cli/tool.h"
#include "tests/format/in_child.h"

#include <CLI/CLI.hpp>
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <thread>

using namespace gsc;

namespace {

// Output on stderr of a stage of a hundred steps, over at once, and of one that fails.
std::string printedBy(ProgressMode mode)
{
    std::string printed;
    CHECK(test::inChild(
              [mode] {
                  StageProgress progress(mode);
                  for (uint64_t i = 0; i <= 100; ++i)
                      progress.update("scan", i, 100);
                  progress.update("write", 3, 10);
                  progress.close(true);
                  return 0;
              },
              &printed) == 0);
    return printed;
}

size_t countOf(const std::string& text, const std::string& part)
{
    size_t count = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++count;
    return count;
}

} // namespace

TEST_CASE("sizes are told in three digits or four, up to the largest there is")
{
    CHECK(formatBytes(0) == "0 B");
    CHECK(formatBytes(1023) == "1023 B");
    CHECK(formatBytes(1024) == "1.00 KiB");
    CHECK(formatBytes(10 * 1024) == "10.0 KiB");
    CHECK(formatBytes(uint64_t(3) << 29) == "1.50 GiB");
    CHECK(formatBytes(UINT64_MAX) == "16.0 EiB");
    CHECK(formatBytes(1023 * 1024) == "1023 KiB");
}

TEST_CASE("counts have their noun, measured values four digits")
{
    CHECK(formatCount(1, "pose") == "1 pose");
    CHECK(formatCount(0, "pose") == "0 poses");
    CHECK(formatCount(1200, "leaf", "leaves") == "1,200 leaves");
    CHECK(formatMeasured(0) == "0.0000");
    CHECK(formatMeasured(0.04667) == "0.0467");
    CHECK(formatMeasured(9.9996) == "10.00");
    CHECK(formatMeasured(99.996) == "100.0");
    CHECK(formatMeasured(-12.345) == "-12.35");
    CHECK(formatMeasured(999.96) == "1,000");
    CHECK(formatMeasured(1234567.8) == "1,234,568");
}

TEST_CASE("progress for a program is an event a line: each stage's start, tenths and end")
{
    const std::string text = printedBy(ProgressMode::Json);
    CHECK(countOf(text, "\n") == 14);
    CHECK(countOf(text, "{\"event\":\"start\",\"stage\":\"scan\"") == 1);
    CHECK(countOf(text, "{\"event\":\"progress\",\"stage\":\"scan\"") == 9);
    CHECK(countOf(text, "{\"event\":\"done\",\"stage\":\"scan\",\"done\":100,\"total\":100") == 1);
    CHECK(countOf(text, "{\"event\":\"start\",\"stage\":\"write\"") == 1);
    CHECK(countOf(text, "{\"event\":\"failed\",\"stage\":\"write\",\"done\":3,\"total\":10") == 1);
}

TEST_CASE("progress in a log is the end of each stage, and nothing of what is over at once")
{
    CHECK(printedBy(ProgressMode::Plain) == "scan: done in 0.0 s\nwrite: failed in 0.0 s\n");
    CHECK(printedBy(ProgressMode::None).empty());
}

TEST_CASE("progress on a terminal is a bar that is redrawn, not one for every step")
{
    const std::string text = printedBy(ProgressMode::Bar);
    CHECK(countOf(text, "\r") >= 3);
    CHECK(countOf(text, "\r") < 20);
    CHECK(countOf(text, "\rscan [####################] 100 %") == 1);
    CHECK(text.substr(text.rfind('\r')).starts_with("\rwrite [######..............]  30 %"));
    CHECK(countOf(text, "\n") == 2);
    CHECK(text.ends_with("s\n"));
}

TEST_CASE("a log tells what is left, by the rate since the stage began: what was done before took no time")
{
    const auto leftOf = [](ProgressMode mode) {
        std::string printed;
        CHECK(test::inChild(
                  [mode] {
                      StageProgress progress(mode);
                      progress.update("render", 80, 100);
                      std::this_thread::sleep_for(std::chrono::milliseconds(1100));
                      progress.setPart("run 9/10");
                      progress.update("render", 90, 100);
                      progress.close(false);
                      return 0;
                  },
                  &printed) == 0);
        return printed;
    };
    CHECK(leftOf(ProgressMode::Plain) == "render, run 9/10: 90 %, 1 s left\nrender: done in 1.1 s\n");
    CHECK(leftOf(ProgressMode::Bar).find(" 90 %  1.1 s  1 s left  [peak") != std::string::npos);
    CHECK(countOf(leftOf(ProgressMode::Json), "\"leftMs\":11") == 1);
}

TEST_CASE("time that is left is told in words of two digits or so")
{
    CHECK(roughTime(0.4) == "0 s");
    CHECK(roughTime(99.4) == "99 s");
    CHECK(roughTime(99.6) == "2 min");
    CHECK(roughTime(99.4 * 60) == "99 min");
    CHECK(roughTime(3600 * 2 + 5 * 60) == "2 h 05 min");
}

TEST_CASE("a message clears the bar that it stands before")
{
    std::string printed;
    CHECK(test::inChild(
              [] {
                  Reporter report({.progress = ProgressMode::Bar, .no_color = true});
                  report.progress("scan", 1, 2);
                  report.warning("odd");
                  report.progress("scan", 2, 2);
                  report.tell("so");
                  report.endProgress(false);
                  return 0;
              },
              &printed) == 0);
    const size_t bar = printed.find("\rscan ["), clear = printed.find('\r', bar + 1);
    const size_t width = clear - bar - 1;
    CHECK(printed.substr(clear, width + 2) == "\r" + std::string(width, ' ') + "\r");
    CHECK(printed.substr(clear + width + 2).starts_with("warning: odd\n\rscan [####"));
    CHECK(printed.find(" \rso\n") != std::string::npos);
    CHECK(countOf(printed, "\n") == 3);
}

TEST_CASE("an error's parts are told apart")
{
    const OrderedJson whole = errorJson({ErrorCode::Io, "a/b", "gone (why, so)", "a file", "check it; or not"});
    CHECK(whole["message"] == "a/b: gone (why, so), expected a file; check it; or not");
    CHECK(whole["subject"] == "a/b");
    CHECK(whole["code"] == "Io");
    CHECK(whole["exit_code"] == 2);
    CHECK(whole["found"] == "gone (why, so)");
    CHECK(whole["expected"] == "a file");
    CHECK(whole["remedy"] == "check it; or not");
}

TEST_CASE("a command names its own options for an error's settings")
{
    const Error error = Error(ErrorCode::OutOfMemory, "cuda", "no room", "some", "draw less")
                            .with({Setting::DeviceMemory, Setting::ImageSize, Setting::CpuBackend});
    CHECK(withOptions(error, nullptr).remedy() == "draw less (--vram-budget, --size or --backend cpu)");
    CLI::App command;
    bool unused = false;
    command.add_flag("--size", unused);
    CHECK(withOptions(error, &command).remedy() == "draw less (--size)");
    const Error lists =
        Error(ErrorCode::Usage, "device 7", "is not there", "another", "see the list").with({Setting::DeviceList});
    CHECK(withOptions(lists, &command).remedy() == "see the list (gsc-play backends)");
}
