// SPDX-License-Identifier: Apache-2.0
#include "format/machine/cgroup.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>
#include <vector>

namespace gsc {

namespace {

// One tree of control groups, and where it is mounted.
struct Hierarchy {
    bool second = false;            // true: version 2 of control groups, whose one tree has all controllers
    std::string controllers;        // controllers of a version 1 tree between commas, such as ",memory,"
    std::string folder, root = "/"; // folder: mount point; root: the group that is mounted there
};

// Group of this process in one tree; `controllers` is empty for version 2.
struct Membership {
    std::string controllers, path;
};

// Text of a field of mountinfo, in which a blank is written as \040.
std::string unescaped(const std::string& text)
{
    std::string out;
    for (size_t i = 0; i < text.size(); ++i)
        if (text[i] == '\\' && text.find_first_not_of("01234567", i + 1) >= i + 4 && i + 3 < text.size()) {
            out += char((text[i + 1] - '0') * 64 + (text[i + 2] - '0') * 8 + (text[i + 3] - '0'));
            i += 3;
        } else {
            out += text[i];
        }
    return out;
}

std::vector<Hierarchy> hierarchiesOf(const std::string& root)
{
    // starts with the usual folder, which counts even if it is no mount point of its own
    std::vector<Hierarchy> all = {{true, "", "/sys/fs/cgroup"}};
    for (const char* const one : {"memory", "pids", "cpu"})
        all.push_back({false, std::string(",") + one + ",", std::string("/sys/fs/cgroup/") + one});
    std::ifstream mounts(root + "/proc/self/mountinfo");
    for (std::string line; std::getline(mounts, line);) {
        const size_t dash = line.find(" - ");
        if (dash == std::string::npos)
            continue;
        std::istringstream before(line), after(line.substr(dash + 3));
        std::string skipped, group, folder, type, options;
        before >> skipped >> skipped >> skipped >> group >> folder;
        after >> type >> skipped >> options;
        if (type == "cgroup2" || type == "cgroup")
            all.push_back({type == "cgroup2", "," + options + ",", unescaped(folder), unescaped(group)});
    }
    return all;
}

std::vector<Membership> membershipsOf(const std::string& root)
{
    std::vector<Membership> all;
    std::ifstream groups(root + "/proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) { // a line is like "4:cpu,cpuacct:/path"
        const size_t first = line.find(':'), second = line.find(':', first + 1);
        if (first == std::string::npos || second == std::string::npos)
            continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        all.push_back({controllers.empty() ? "" : "," + controllers + ",", line.substr(second + 1)});
    }
    return all;
}

// Path of the group relative to the folder where the tree is mounted, "" for that folder: in a container the process
// may be told of a path that cannot be seen from inside.
std::string below(const Hierarchy& tree, std::string path)
{
    if (!path.starts_with('/'))
        return "";
    if (tree.root != "/") {
        if (path != tree.root && !path.starts_with(tree.root + "/"))
            return "";
        path = path.substr(tree.root.size());
    }
    return path == "/" || path.find("/..") != std::string::npos ? "" : path;
}

// Calls take(folder) for the group of this process and for each group around it, in every tree.
void forEachGroup(const std::string& root, const std::vector<Hierarchy>& trees, const std::vector<Membership>& places,
                  const std::string& controller,
                  const std::function<void(const std::string& folder, bool second)>& take)
{
    const std::string word = "," + controller + ",";
    for (const Hierarchy& tree : trees) {
        if (!tree.second && tree.controllers.find(word) == std::string::npos)
            continue;
        std::string path;
        for (const Membership& place : places)
            if (tree.second ? place.controllers.empty() : place.controllers.find(word) != std::string::npos)
                path = below(tree, place.path);
        for (;; path.resize(path.rfind('/'))) {
            take(root + tree.folder + path + "/", tree.second);
            if (path.empty())
                break;
        }
    }
}

// First two words of a file; empty if it cannot be read.
std::vector<std::string> wordsOf(const std::string& path)
{
    std::ifstream file(path);
    std::vector<std::string> words;
    for (std::string word; words.size() < 2 && file >> word;)
        words.push_back(word);
    return words;
}

// Limit that word `i` states; "max", and any word that is no number, means no limit.
uint64_t limitOf(const std::vector<std::string>& words, size_t i = 0)
{
    uint64_t value = 0;
    if (i >= words.size() || words[i].find_first_not_of("0123456789") != std::string::npos ||
        !(std::istringstream(words[i]) >> value))
        return std::numeric_limits<uint64_t>::max();
    return value;
}

// Bytes of cached files that count as the group's memory; the system frees them when memory is short.
uint64_t fileBytes(const std::string& folder, bool second)
{
    std::ifstream file(folder + "memory.stat");
    // prefix of the sums of version 1 that include the groups below
    const std::string prefix = second ? "" : "total_";
    uint64_t bytes = 0, value = 0;
    for (std::string word; file >> word >> value;)
        if (word == prefix + "inactive_file" || word == prefix + "active_file")
            bytes += value;
    return bytes;
}

void takeMemory(const std::string& folder, bool second, CgroupLimits& limits)
{
    const uint64_t most = limitOf(wordsOf(folder + (second ? "memory.max" : "memory.limit_in_bytes")));
    // memory.high: above it a process becomes very slow but lives; budgets stay below it, but no memory is refused
    if (second)
        limits.memory = std::min(limits.memory, limitOf(wordsOf(folder + "memory.high")));
    if (most == std::numeric_limits<uint64_t>::max())
        return;
    const std::vector<std::string> words = wordsOf(folder + (second ? "memory.current" : "memory.usage_in_bytes"));
    const uint64_t used = words.empty() ? 0 : limitOf(words), files = fileBytes(folder, second);
    const uint64_t kept = used - std::min(used, files);
    limits.memory = std::min(limits.memory, most);
    limits.memory_free = std::min(limits.memory_free, most - std::min(most, kept));
}

// Number of processors that `quota` microseconds in each `period` microseconds amount to.
double shareOf(uint64_t quota, uint64_t period)
{
    constexpr uint64_t none = std::numeric_limits<uint64_t>::max();
    if (quota == none || quota == 0 || period == none || period == 0)
        return std::numeric_limits<double>::infinity();
    return double(quota) / double(period);
}

} // namespace

CgroupLimits cgroupLimits(const std::string& root)
{
    CgroupLimits limits;
    const std::vector<Hierarchy> trees = hierarchiesOf(root);
    const std::vector<Membership> places = membershipsOf(root);
    forEachGroup(root, trees, places, "memory",
                 [&](const std::string& folder, bool second) { takeMemory(folder, second, limits); });
    forEachGroup(root, trees, places, "pids", [&](const std::string& folder, bool) {
        limits.pids = std::min(limits.pids, limitOf(wordsOf(folder + "pids.max")));
    });
    forEachGroup(root, trees, places, "cpu", [&](const std::string& folder, bool second) {
        const std::vector<std::string> words = wordsOf(folder + (second ? "cpu.max" : "cpu.cfs_quota_us"));
        const uint64_t period = second ? limitOf(words, 1) : limitOf(wordsOf(folder + "cpu.cfs_period_us"));
        limits.processors = std::min(limits.processors, shareOf(limitOf(words), period));
    });
    return limits;
}

} // namespace gsc
