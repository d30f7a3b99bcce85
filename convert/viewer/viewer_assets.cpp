// SPDX-License-Identifier: Apache-2.0
#include "convert/viewer/viewer_assets.h"

#include "convert/page/asset.h"

GSC_ASSET(viewerTemplate, "page/viewer.html");
GSC_ASSET(viewerStyle, "page/viewer.css");
GSC_ASSET(viewerScript, "page/viewer.js");
GSC_ASSET(playcanvasScript, "playcanvas/playcanvas.min.js");
GSC_ASSET(playcanvasLicence, "playcanvas/LICENSE");
