// SPDX-License-Identifier: Apache-2.0
// Control groups as containers, systemd and batch systems leave them, read from folders that stand for /.
#include "format/machine/cgroup.h"
#include "format/machine/machine.h"
#include "format/machine/threads.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

namespace {

namespace fs = std::filesystem;

constexpr uint64_t kNone = std::numeric_limits<uint64_t>::max();
constexpr double kAll = std::numeric_limits<double>::infinity();

const char* const kSecond = "30 20 0:27 / /sys/fs/cgroup rw,relatime shared:9 - cgroup2 cgroup2 rw,nsdelegate\n";
const char* const kFirst = "31 23 0:28 / /sys/fs/cgroup ro - tmpfs tmpfs ro,mode=755\n"
                           "32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n"
                           "35 31 0:32 / /sys/fs/cgroup/memory rw shared:4 - cgroup cgroup rw,memory\n"
                           "39 31 0:36 / /sys/fs/cgroup/pids rw - cgroup cgroup rw,pids\n";

using Files = std::vector<std::pair<std::string, std::string>>;

struct Root {
    explicit Root(const Files& files)
    {
        char name[] = "/tmp/gsc_machine_XXXXXX";
        path = mkdtemp(name);
        for (const auto& [file, text] : files) {
            fs::create_directories(fs::path(path + file).parent_path());
            std::ofstream(path + file) << text;
        }
    }
    ~Root() { fs::remove_all(path); }
    Root(const Root&) = delete;
    Root& operator=(const Root&) = delete;

    std::string path;
};

gsc::CgroupLimits limitsOf(const char* groups, const char* mounts, Files files)
{
    files.emplace_back("/proc/self/cgroup", groups);
    files.emplace_back("/proc/self/mountinfo", mounts);
    return gsc::cgroupLimits(Root(files).path);
}

} // namespace

TEST_CASE("where there are no groups, or none can be read, nothing is limited")
{
    for (const gsc::CgroupLimits& limits :
         {gsc::cgroupLimits("/nowhere"), limitsOf("", "", {}), limitsOf("0::/a\n", kSecond, {}),
          limitsOf("4:memory:/a\n0::/\n", kFirst, {}), limitsOf("nonsense\n:\n", "nonsense - \n - cgroup2\n", {})}) {
        CHECK(limits.memory == kNone);
        CHECK(limits.memory_free == kNone);
        CHECK(limits.pids == kNone);
        CHECK(limits.processors == kAll);
    }
}

TEST_CASE("version 2: the least of a group and those around it")
{
    const gsc::CgroupLimits limits = limitsOf("0::/user.slice/job\n", kSecond,
                                              {{"/sys/fs/cgroup/user.slice/memory.max", "1000000\n"},
                                               {"/sys/fs/cgroup/user.slice/memory.high", "max\n"},
                                               {"/sys/fs/cgroup/user.slice/cpu.max", "max 100000\n"},
                                               {"/sys/fs/cgroup/user.slice/pids.max", "77\n"},
                                               {"/sys/fs/cgroup/user.slice/job/memory.max", "2000000\n"},
                                               {"/sys/fs/cgroup/user.slice/job/cpu.max", "150000 100000\n"},
                                               {"/sys/fs/cgroup/user.slice/job/pids.max", "max\n"}});
    CHECK(limits.memory == 1000000);
    CHECK(limits.pids == 77);
    CHECK(limits.processors == 1.5);
}

TEST_CASE("version 2: memory.high slows down and kills nobody; what is used already counts but for files")
{
    const gsc::CgroupLimits limits = limitsOf(
        "0::/\n", kSecond,
        {{"/sys/fs/cgroup/memory.max", "1000000\n"},
         {"/sys/fs/cgroup/memory.high", "900000\n"},
         {"/sys/fs/cgroup/memory.current", "500000\n"},
         {"/sys/fs/cgroup/memory.stat", "anon 100000\nfile 400000\ninactive_file 250000\nactive_file 150000\n"}});
    CHECK(limits.memory == 900000);
    CHECK(limits.memory_free == 900000); // free memory of memory.max
    const gsc::CgroupLimits slowed = limitsOf(
        "0::/\n", kSecond, {{"/sys/fs/cgroup/memory.high", "900000\n"}, {"/sys/fs/cgroup/memory.current", "500000\n"}});
    CHECK(slowed.memory == 900000);
    CHECK(slowed.memory_free == kNone);
}

TEST_CASE("a group whose path cannot be seen from here: the folder that is mounted is the process's own")
{
    const Files own = {{"/sys/fs/cgroup/memory.max", "5000\n"}};
    CHECK(limitsOf("0::/\n", kSecond, own).memory == 5000);                            // a namespace of its own
    CHECK(limitsOf("0::/../../other\n", kSecond, own).memory == 5000);                 // moved out of it
    CHECK(limitsOf("0::/docker/0123\n", kSecond, own).memory == 5000);                 // the host's path
    for (const char* const path : {"0::\n", "0::a\n", "0::a/b\n", "0::docker/0123\n"}) // no path at all
        CHECK(limitsOf(path, kSecond, own).memory == 5000);
    CHECK(limitsOf("0::docker/0123\n", "30 20 0:27 docker /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n", own).memory ==
          5000);
    const char* const bound = "30 20 0:27 /docker/0123 /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n";
    CHECK(limitsOf("0::/docker/0123\n", bound, own).memory == 5000); // a part of the host's tree
    CHECK(limitsOf("0::/docker/0124\n", bound, own).memory == 5000); // path of another container
    const Files inner = {{"/sys/fs/cgroup/in/memory.max", "6000\n"}};
    CHECK(limitsOf("0::/docker/0123/in\n", bound, inner).memory == 6000);
}

TEST_CASE("version 1: each controller has a tree, and what is unlimited is a large number or -1")
{
    const gsc::CgroupLimits limits =
        limitsOf("12:pids:/box\n9:memory:/box/in\n3:cpu,cpuacct:/box\n1:name=systemd:/x\n0::/\n", kFirst,
                 {{"/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"},
                  {"/sys/fs/cgroup/memory/box/memory.limit_in_bytes", "536870912\n"},
                  {"/sys/fs/cgroup/memory/box/memory.usage_in_bytes", "200000000\n"},
                  {"/sys/fs/cgroup/memory/box/memory.stat",
                   "inactive_file 1\nactive_file 1\ntotal_inactive_file 100000000\ntotal_active_file 50000000\n"},
                  {"/sys/fs/cgroup/memory/box/in/memory.limit_in_bytes", "9223372036854771712\n"},
                  {"/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n"},
                  {"/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n"},
                  {"/sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_quota_us", "250000\n"},
                  {"/sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_period_us", "50000\n"},
                  {"/sys/fs/cgroup/pids/box/pids.max", "40\n"}});
    CHECK(limits.memory == 536870912);
    CHECK(limits.memory_free == 486870912);
    CHECK(limits.processors == 5);
    CHECK(limits.pids == 40);
}

TEST_CASE("both versions at once: controllers of the first, and a second tree that may have others")
{
    const std::string mounts = std::string(kFirst) + "41 31 0:38 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n";
    const gsc::CgroupLimits limits = limitsOf("4:memory:/box\n0::/two\n", mounts.c_str(),
                                              {{"/sys/fs/cgroup/memory/box/memory.limit_in_bytes", "1000\n"},
                                               {"/sys/fs/cgroup/unified/two/pids.max", "9\n"}});
    CHECK(limits.memory == 1000);
    CHECK(limits.pids == 9);
}

TEST_CASE("a tree that is mounted elsewhere, in a folder with a blank; and one that nothing says is mounted")
{
    const char* const elsewhere = "30 20 0:27 / /mnt/my\\040groups rw - cgroup2 none rw\n";
    CHECK(limitsOf("0::/a\n", elsewhere, {{"/mnt/my groups/a/memory.max", "700\n"}}).memory == 700);
    CHECK(gsc::cgroupLimits(Root(Files{{"/sys/fs/cgroup/memory.max", "800\n"}}).path).memory == 800);
    CHECK(gsc::cgroupLimits(Root(Files{{"/sys/fs/cgroup/memory/memory.limit_in_bytes", "900\n"}}).path).memory == 900);
}

TEST_CASE("what is no number limits nothing, and nothing is divided by zero")
{
    for (const char* text : {"", "\n", "max\n", "-1\n", "12x\n", "99999999999999999999999\n", "0x10\n"}) {
        CAPTURE(text);
        const gsc::CgroupLimits limits = limitsOf(
            "0::/\n", kSecond,
            {{"/sys/fs/cgroup/memory.max", text}, {"/sys/fs/cgroup/pids.max", text}, {"/sys/fs/cgroup/cpu.max", text}});
        CHECK(limits.memory == kNone);
        CHECK(limits.pids == kNone);
        CHECK(limits.processors == kAll);
    }
    CHECK(limitsOf("0::/\n", kSecond, {{"/sys/fs/cgroup/cpu.max", "100000 0\n"}}).processors == kAll);
    CHECK(limitsOf("0::/\n", kSecond, {{"/sys/fs/cgroup/memory.max", "0\n"}}).memory_free == 0);
}

TEST_CASE("this machine")
{
    CHECK(gsc::usableMemory() > 1 << 20);
    CHECK(gsc::usableProcessors() >= 1);
    CHECK(gsc::usableProcessors() <= int(std::max(1u, std::thread::hardware_concurrency())));
    CHECK(gsc::startableThreads(3) == 3);
    CHECK(gsc::startableThreads(0) == 0);
    CHECK(gsc::poolThreads(1) == 1);
    CHECK(gsc::poolThreads(3) == 3);
    CHECK(gsc::poolThreads(0) == gsc::usableProcessors());
    CHECK(gsc::threadLimits().find("pids.max is ") != std::string::npos);
}

TEST_CASE("too few threads are an error that names the limits")
{
    gsc::requireThreads("a pool", 2);
    const gsc::Error error = gsc::tooFewThreads("a pool", 7);
    CHECK(error.code() == gsc::ErrorCode::OutOfMemory);
    const std::string text = error.what();
    CHECK(text.find("a pool: too few threads can be started (ulimit -u is ") == 0);
    CHECK(text.find(", expected 7; ") != std::string::npos);
    int ran = 0;
    gsc::startThread<std::thread>("x", [&] { ran = 1; }).join();
    CHECK(ran == 1);
    CHECK_FALSE(gsc::ThreadAttempt::isOn());
}
