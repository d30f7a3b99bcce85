// SPDX-License-Identifier: Apache-2.0
// Sound files that gsc did not write: what their manifest claims and how their rows are numbered is not trusted.
#include "convert/bake/model/gsc_checkpoint.h"
#include "convert/bake/tiles/tiles.h"
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include "sample/sample_tools.h"
#include "tests/format/tiny_gsc.h"

#include <doctest/doctest.h>

#include <fstream>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Foreign {
    explicit Foreign(const TinyGscOptions& options, uint32_t row = 0)
    {
        std::vector<std::byte> bytes = tinyGsc(options);
        if (row != 0) {
            records<uint32_t>(bytes, kSectionEmbedding)[options.appearance_rows - 1] = row;
            reseal(bytes);
        }
        std::ofstream(path(), std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
        file = std::make_unique<GscFile>(path(), throwFirstIssue("foreign"));
        REQUIRE(openGsc(file->bytes(), view, GscCheck::Full, throwFirstIssue("foreign")));
    }

    [[nodiscard]] std::string path() const { return folder / "foreign.gsc"; }

    // All of its anchors, written again.
    [[nodiscard]] std::string written() const
    {
        TileOptions options;
        options.inputs = options.names = {path()};
        options.output = folder / "written.gsc";
        options.overwrite = true;
        (void)joinTiles(options, {});
        return options.output;
    }

    TemporaryFolder folder;
    std::unique_ptr<GscFile> file;
    GscView view;
};

} // namespace

TEST_CASE("rows of the embedding keep their numbers, and a large one takes no memory")
{
    TinyGscOptions options;
    options.appearance_dim = 4;
    options.appearance_rows = 3;
    const Foreign foreign(options, 2'000'000'000);
    CHECK(checkpointOf(foreign.view, "foreign").embedding.size() == 12);
    const GscFile again(foreign.written(), throwFirstIssue("written"));
    GscView view;
    REQUIRE(openGsc(again.bytes(), view, GscCheck::Full, throwFirstIssue("written")));
    CHECK(std::ranges::equal(view.embedding_rows, foreign.view.embedding_rows));
    CHECK(std::ranges::equal(view.embedding, foreign.view.embedding));
}

TEST_CASE("a manifest of other types, or one that nests without end, is no obstacle")
{
    const std::string deep(200'000, '['), back(200'000, ']');
    for (const std::string& manifest :
         {std::string(R"({"source":{"container":7,"iteration":"x"},"options":{"chunk_anchors":-3,"appearance":[1]}})"),
          std::string(R"({"source":5,"options":{"chunk_anchors":18446744073709551615,"drop_invalid":"no"},"crop":7})"),
          "{\"source\":" + deep + back + "}"}) {
        TinyGscOptions options;
        options.manifest = manifest;
        const Foreign foreign(options);
        CHECK(writeOptionsOf(foreign.view).chunk_anchors == WriteOptions().chunk_anchors);
        CHECK(checkpointOf(foreign.view, "foreign").container.empty());
        const GscFile again(foreign.written(), throwFirstIssue("written"));
        GscView view;
        CHECK(openGsc(again.bytes(), view, GscCheck::Full, throwFirstIssue("written")));
        CHECK(view.header->anchor_count == foreign.view.header->anchor_count);
    }
}
