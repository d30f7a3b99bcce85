// SPDX-License-Identifier: Apache-2.0
#include "sample/sample_tools.h"

#include <gsc/checksum.h>
#include <gsc/error.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <sstream>
#include <stdexcept>

namespace gsc::test {

namespace fs = std::filesystem;

std::string readText(const fs::path& path)
{
    std::ifstream in(path, std::ios::binary);
    if (!in)
        throw std::runtime_error("cannot open " + path.string());
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::map<std::string, uint64_t> hashFolder(const fs::path& folder)
{
    std::map<std::string, uint64_t> hashes;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) {
            const std::string bytes = readText(entry.path());
            hashes[fs::relative(entry.path(), folder).string()] = checksum64(std::as_bytes(std::span(bytes)));
        }
    return hashes;
}

size_t PlyRows::column(const std::string& name) const
{
    const auto at = std::find(columns.begin(), columns.end(), name);
    if (at == columns.end())
        throw std::runtime_error("no column " + name);
    return size_t(at - columns.begin());
}

PlyRows readPlyRows(const fs::path& path)
{
    const std::string bytes = readText(path);
    const std::string end = "end_header\n";
    const size_t body = bytes.find(end) + end.size();
    PlyRows ply;
    size_t count = 0;
    std::istringstream header(bytes.substr(0, body));
    for (std::string line; std::getline(header, line);) {
        std::istringstream words(line);
        std::string word, type, name;
        words >> word >> type >> name;
        if (word == "element")
            count = std::stoull(name);
        if (word == "property")
            ply.columns.push_back(name);
    }
    ply.values.resize(count * ply.columns.size());
    if (bytes.size() - body != ply.values.size() * sizeof(float))
        throw std::runtime_error(path.string() + ": size and header disagree");
    std::memcpy(ply.values.data(), bytes.data() + body, bytes.size() - body);
    return ply;
}

fs::path plyOf(const fs::path& model)
{
    return fs::directory_iterator(model / "point_cloud")->path() / "point_cloud.ply";
}

SampleOptions sampleOptions(SampleScene scene, SampleModel model, uint64_t anchors, const std::string& output)
{
    SampleOptions options;
    options.scene = scene;
    options.model = model;
    options.anchors = anchors;
    options.output = output;
    return options;
}

Outcome tryMake(const SampleOptions& options)
{
    return outcomeOf([&] { makeSample(options, {}); });
}

Outcome tryReplicate(const ReplicateOptions& options)
{
    return outcomeOf([&] { replicateCheckpoint(options, {}); });
}

} // namespace gsc::test
