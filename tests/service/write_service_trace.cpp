// SPDX-License-Identifier: Apache-2.0
// write_service_trace: the trace of a service of two workers, one of which fails now and then, as a line of JSON.
#include "player/devices/make_service_trace.h"
#include "runtime/service/faulty_renderer.h"
#include "tests/service/service_tools.h"

#include <cstdio>

using namespace gsc;
using namespace gsc::test;

int main()
{
    const SyntheticModel model(modelOptions());
    Faults faults;
    faults.throws = 0.05;
    ServiceOptions options = cpuWorkers(2, ServiceMode::Frame);
    options.keeps_all = false;
    options.make = withFaults(faults);
    options.comes_back = std::chrono::milliseconds(2);
    options.most_faults = 1000;
    options.attempts = 1000;
    options.trace_limit = 100000;
    RendererService service(model.view(), options);
    for (int i = 0; i < 150; ++i) {
        submitWalk(service, i, 1, with(ReusePolicy::None));
        if (i % 3 != 0) // now and then two are there at once
            (void)service.next();
    }
    while (service.next()) {
    }
    ServiceTraceReport report = makeServiceTrace(service.trace(), service.stats());
    report.tool = thisTool();
    report.file = "synthetic.gsc";
    report.options = {serviceModeName(options.mode), 0, 0, 0, options.keeps_all, {"cpu", "cpu"}};
    return std::puts(jsonText(toJson(report), -1).c_str()) < 0;
}
