(function(){"use strict";const oe=`
#define ROW 44
#define EDGE 1e-6
layout(std140) uniform Edits { vec4 rows[1024]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and how far off that is.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at, p - rows[at + 3].xyz);
  vec3 xi = y;
  error = 0.0;
  if (rows[at].w < 0.5) {
    if (inBox(y, rows[at + 4].xyz, rows[at + 5].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + 6, xi, bent(at + 6, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + 6, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at, v);
  int c = at + 10;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
  if (rows[at].w < 0.5) {
    along = bendSolve(at + 6, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & 2047, n >> ${Math.log2(2048)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + 3, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + 6].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Takes a sample through the edit whose numbers begin at a row; true where it was emptied.
bool mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return false;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return false;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return false;
    }
  }
  if (rows[e + 1].w < 1.5) return false;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return false;
}

MAP_SAMPLE
// The part of a ray outside which no edit changes anything.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * ROW + 2 * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,ae=2;function ce(r){return r<=ae?r:null}function le(r){const e=s=>`if (inBox(p, rows[${s}].xyz, rows[${s} + 1].xyz) && mapEdit(${s}, p, v)) return true;`,i=["bool mapSample(inout vec3 p, inout vec3 v) {",...(r===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:r},(s,n)=>e(`${r-1-n} * ROW`))).map(s=>`  ${s}`),"  return false;","}"];return oe.replace("MAP_SAMPLE",`${i.join(`
`)}
`)}function z(r,e,t){const i=performance.now(),s=r.createProgram();for(const[a,c]of[[r.VERTEX_SHADER,e],[r.FRAGMENT_SHADER,t]]){const l=r.createShader(a);if(l===null)throw new Error("the GPU's context is lost");r.shaderSource(l,c),r.compileShader(l),r.attachShader(s,l),r.deleteShader(l)}if(r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost()){const c=(r.getAttachedShaders(s)??[]).map(l=>r.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${r.getProgramInfoLog(s)??""}`)}const n=new Map;return{program:s,uniform:a=>{const c=n.get(a);if(c!==void 0)return c;const l=r.getUniformLocation(s,a);return n.set(a,l),l},milliseconds:performance.now()-i}}class he extends Error{constructor(){super("the GPU has not enough memory for the field")}}function C(r){for(let e=r.getError();e!==r.NO_ERROR&&e!==r.CONTEXT_LOST_WEBGL;e=r.getError())if(e===r.OUT_OF_MEMORY)throw new he}function A(r,e,t,i){const s=r.createTexture();r.bindTexture(r.TEXTURE_3D,s),r.texStorage3D(r.TEXTURE_3D,1,e,t[0],t[1],t[2]),W(r,r.TEXTURE_3D,i);try{C(r)}catch(n){throw r.deleteTexture(s),n}return s}function W(r,e,t){r.texParameteri(e,r.TEXTURE_MIN_FILTER,t),r.texParameteri(e,r.TEXTURE_MAG_FILTER,t);for(const i of e===r.TEXTURE_3D?[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T,r.TEXTURE_WRAP_R]:[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(e,i,r.CLAMP_TO_EDGE)}function M(r){r.bindBuffer(r.PIXEL_UNPACK_BUFFER,null),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.pixelStorei(r.UNPACK_FLIP_Y_WEBGL,!1),r.pixelStorei(r.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),r.pixelStorei(r.UNPACK_COLORSPACE_CONVERSION_WEBGL,r.NONE);for(const e of[r.UNPACK_ROW_LENGTH,r.UNPACK_IMAGE_HEIGHT,r.UNPACK_SKIP_PIXELS,r.UNPACK_SKIP_ROWS,r.UNPACK_SKIP_IMAGES])r.pixelStorei(e,0)}class ue{constructor(e){this.gl=e}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}set(e){if(this.uploaded.last=0,e===null||e.edits===0){this.dispose();return}if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");this.putRows(e),this.putLattices(e),this.putOccupancy(e),this.current=e,this.uploaded.total+=this.uploaded.last}bind(e){const{gl:t}=this;return t.uniformBlockBinding(e,t.getUniformBlockIndex(e,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:e}=this;e.deleteBuffer(this.buffer),e.deleteTexture(this.lattices?.texture??null),e.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:e}){const{gl:t}=this,i=this.buffer===null;this.buffer??=t.createBuffer(),t.bindBuffer(t.UNIFORM_BUFFER,this.buffer),i&&t.bufferData(t.UNIFORM_BUFFER,16*1024,t.DYNAMIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e),t.bindBuffer(t.UNIFORM_BUFFER,null),this.uploaded.last+=e.byteLength}putLattices({lattices:e}){const{gl:t}=this,i=e.map(({halves:c})=>Math.ceil(c.length/(3*2048))),s=Math.max(1,i.reduce((c,l)=>c+l,0));if(s>t.getParameter(t.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||s>this.lattices.rows)&&(t.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(s),rows:s,placed:[]});const{texture:n,placed:o}=this.lattices;M(t),t.bindTexture(t.TEXTURE_2D,n);let a=0;this.lattices.placed=e.map(({key:c,halves:l},f)=>{const h={key:c,row:a};if(o.every(u=>u.key!==c||u.row!==h.row)){const u=6144*i[f],d=l.length===u?l:new Uint16Array(u);d!==l&&d.set(l),t.texSubImage2D(t.TEXTURE_2D,0,0,a,2048,i[f],t.RGB,t.HALF_FLOAT,d),this.uploaded.last+=d.byteLength}return a+=i[f],h}),t.bindTexture(t.TEXTURE_2D,null),C(t)}latticeTexture(e){const{gl:t}=this,i=t.createTexture();return t.bindTexture(t.TEXTURE_2D,i),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,e),W(t,t.TEXTURE_2D,t.NEAREST),i}putOccupancy({occupancy:{key:e,dims:t,codes:i,changed:s}}){const{gl:n,occupancy:o}=this;if(o?.key===e)return;M(n);const a=o!==null&&o.dims.every((d,p)=>d===t[p]);a||n.deleteTexture(o?.texture??null);const c=a?o.texture:A(n,n.R16UI,[t[2],t[1],t[0]],n.NEAREST),l=a&&s?.of===o.key?s:{low:[0,0,0],dims:t,codes:i};n.bindTexture(n.TEXTURE_3D,c);const[f,h,u]=l.low;n.texSubImage3D(n.TEXTURE_3D,0,u,h,f,l.dims[2],l.dims[1],l.dims[0],n.RED_INTEGER,n.UNSIGNED_SHORT,l.codes),n.bindTexture(n.TEXTURE_3D,null),this.occupancy={texture:c,key:e,dims:t},this.uploaded.last+=l.codes.byteLength}}class H extends Error{}function fe(r,e){const t=r.field.brick,i=t+1,s=r.header.resolution.map(u=>Math.ceil((u-1)/t)),n=me(r,s),o=Math.min(255,Math.floor(e/i)),a=Math.min(o,Math.max(1,Math.ceil(Math.cbrt(n.length)))),c=Math.min(o,Math.max(1,Math.ceil(Math.sqrt(n.length/a)))),l=Math.max(1,Math.ceil(n.length/(a*c)));if(l>o)throw new H(`${n.length} bricks do not fit into textures of ${e} texels an edge`);const f=new Uint8Array(4*s[0]*s[1]*s[2]);for(const[u,d]of n.entries())f.set([u%a,Math.floor(u/a)%c,Math.floor(u/(a*c)),255],4*d);const h=Math.ceil(3*r.header.steps.length/4);return{brick:t,edge:i,dims:s,across:[a,c,l],count:n.length,index:f,bricks:n,colours:h}}function de({across:r,edge:e,colours:t,index:i}){return r[0]*r[1]*r[2]*e**3*(2+4*t)+i.length}function me(r,e){const{codes:t,dims:i}=r.occupancy,s=r.field.brick/4,n=new Uint8Array(e[0]*e[1]*e[2]);let o=0;for(let a=0;a<i[0];a++)for(let c=0;c<i[1];c++)for(let l=0;l<i[2];l++,o++)t[o]<256&&(n[(Math.floor(a/s)*e[1]+Math.floor(c/s))*e[2]+Math.floor(l/s)]=1);return Int32Array.from(n.keys()).filter(a=>n[a]===1)}class pe{constructor(e,t){this.level=e,this.layout=t;const{brick:i}=t;this.wire=e.header.resolution.map(a=>Math.ceil(a/i));const s=i**3;this.numbers=new Int32Array(e.bricks.length).fill(-1),this.slots=new Int32Array(e.masks.length/(s/8)*s).fill(-1);let n=0;e.bricks.forEach((a,c)=>{a&&(this.numbers[c]=n++)});let o=0;for(let a=0;a<this.slots.length;a++)e.masks[a>>3]>>(a&7)&1&&(this.slots[a]=o++)}slots;numbers;wire;layer(e){const{across:t,edge:i,count:s,colours:n,bricks:o}=this.layout,a=t[0]*t[1]*i**3,c={density:new Uint16Array(a),colours:Array.from({length:n},()=>new Uint8Array(4*a).fill(128))},l=e*t[0]*t[1],f=new Int32Array(i**3);for(let h=l;h<Math.min(s,l+t[0]*t[1]);h++)this.vertices(o[h],f),this.put(c,h-l,f);return c}vertices(e,t){const{dims:i,brick:s,edge:n}=this.layout,o=[Math.floor(e/(i[1]*i[2])),Math.floor(e/i[2])%i[1],e%i[2]];let a=0;for(let c=0;c<n;c++)for(let l=0;l<n;l++)for(let f=0;f<n;f++,a++){const h=c<s?o[0]:o[0]+1,u=l<s?o[1]:o[1]+1,d=f<s?o[2]:o[2]+1;if(t[a]=-1,h>=this.wire[0]||u>=this.wire[1]||d>=this.wire[2])continue;const p=this.numbers[(h*this.wire[1]+u)*this.wire[2]+d];p>=0&&(t[a]=this.slots[((p*s+c%s)*s+l%s)*s+f%s])}}put(e,t,i){const{across:s,edge:n}=this.layout,{density:o,sh:a,header:c}=this.level,l=s[0]*n,f=l*s[1]*n,h=t%s[0]*n+Math.floor(t/s[0])*n*l,u=3*c.steps.length;let d=0;for(let p=0;p<n;p++)for(let m=0;m<n;m++)for(let v=0;v<n;v++,d++){const x=i[d];if(x<0)continue;const y=h+p*f+m*l+v;e.density[y]=o[x];for(let w=0;w<u;w++)e.colours[w>>2][4*y+(w&3)]=a[w*c.vertices+x]}}}async function xe(r,e,t,i){const s=fe(e,r.getParameter(r.MAX_3D_TEXTURE_SIZE)),n=de(s);if(n>t)throw new H(`the field takes ${Math.ceil(n/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);const{across:o,edge:a,dims:c}=s,l=o.map(h=>h*a),f=[];try{const h=A(r,r.R16F,l,r.LINEAR);f.push(h);const u=Array.from({length:s.colours},()=>{const m=A(r,r.RGBA8,l,r.LINEAR);return f.push(m),m}),d=new pe(e,s);for(let m=0;m<o[2];m++){const v=d.layer(m);M(r);const x=(y,w,I,$)=>{r.bindTexture(r.TEXTURE_3D,y),r.texSubImage3D(r.TEXTURE_3D,0,0,0,m*a,l[0],l[1],a,w,I,$)};if(x(h,r.RED,r.HALF_FLOAT,v.density),v.colours.forEach((y,w)=>x(u[w],r.RGBA,r.UNSIGNED_BYTE,y)),r.bindTexture(r.TEXTURE_3D,null),await new Promise(y=>setTimeout(y)),!i())throw new Error("not wanted any more")}M(r);const p=A(r,r.RGBA8UI,[c[2],c[1],c[0]],r.NEAREST);return f.push(p),r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,c[2],c[1],c[0],r.RGBA_INTEGER,r.UNSIGNED_BYTE,s.index),r.bindTexture(r.TEXTURE_3D,null),C(r),{layout:s,density:h,colours:u,index:p,bytes:n}}catch(h){for(const u of f)r.deleteTexture(u);if(!i())return null;throw h}}function q(r,{dims:e,codes:t}){M(r);const i=A(r,r.R16UI,[e[2],e[1],e[0]],r.NEAREST);return r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],r.RED_INTEGER,r.UNSIGNED_SHORT,t),r.bindTexture(r.TEXTURE_3D,null),i}function ve(r,e){for(const t of[e.density,e.index,...e.colours])r.deleteTexture(t)}class N{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:s,done:n}=await this.source.read();if(n)throw new Error("the file of the field is truncated");this.held.push(s),this.length+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let i=0;for(;i<e;){const s=this.held[0],n=s.subarray(0,e-i);t.set(n,i),i+=n.length,n.length===s.length?this.held.shift():this.held[0]=s.subarray(n.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function ye(r){const e=new Blob([r]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class S{constructor(e,t,i){this.header=e,this.entries=t,this.reader=i}next=0;static async open(e,t,i){const s=await e.take(16),n=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const o=n.getUint32(8,!0);if(o!==i)throw new Error(`"${t}" of version ${o}, this page reads ${i}; reload it`);const a=new TextDecoder().decode(await e.take(n.getUint32(12,!0))),c=JSON.parse(a);return new S(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const i=await ye(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(i);case"u2":return new Uint16Array(i);case"i4":return new Int32Array(i);case"f4":return new Float32Array(i)}}}const we="cagepage",Ee=1;async function*Te(r,e){const t=new N(r,e);try{const i=await S.open(t,we,Ee);for(const[s,n]of i.header.levels.entries()){const o=await i.read(`${s}.bricks`),a=await i.read(`${s}.masks`),c=await i.read(`${s}.occupancy`),l=await i.read(`${s}.density`),f=await i.read(`${s}.sh`);yield{field:i.header,header:n,last:s===i.header.levels.length-1,bricks:o,masks:a,density:k(l),sh:ge(f,n.vertices),occupancy:{origin:[0,0,0],dims:n.dims,codes:c}}}}finally{t.cancel()}}function k(r){const e=r.length/2,t=new Uint16Array(e);for(let i=0;i<e;i++)t[i]=r[i]|r[e+i]<<8;return t}function ge(r,e){for(let t=0;t<r.length;t+=e){let i=128;for(let s=t;s<t+e;s++)r[s]=i=i+r[s]&255}return r}const be=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)"];function Re(r){const e=Math.ceil(3*r/4),t=[`uniform float coefficientSteps[${r}];`,...Array.from({length:e},(i,s)=>`uniform sampler3D colourAtlas${s};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(i,s)=>`  vec4 s${s} = 255.0 * textureLod(colourAtlas${s}, at, 0.0) - 128.0;`)];for(let i=0;i<r;i++){const s=[0,1,2].map(n=>`s${3*i+n>>2}.${"xyzw"[3*i+n&3]}`);t.push(`  rgb += (coefficientSteps[${i}] * (${be[i]})) * vec3(${s.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const L=`#version 300 es
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 0.0, 1.0);
}`,_e=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// The texel, whole where a vertex is, of grid coordinates in the atlas; false where their brick is empty.
bool locate(vec3 g, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 place = texelFetch(brickIndex, b.zyx, 0);
  corner = ivec3(place.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return place.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,Ae=`
// Rounded here, and put amid the step: some GPUs cut off where others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      bool emptied = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (emptied) alive = false;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colourAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLOURS;
#endif
          rgb += w * clamp(c, 0.0, 1.0);
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColour = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function Me(r,e){const{source:t,colours:i}=Re(r.K),s=[`#define BRICK ${e}`,`#define COLOURS ${i}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return r.contracted&&s.push("#define CONTRACTED"),r.edited&&s.push("#define EDITED"),r.normals&&s.push("#define NORMALS"),r.count&&s.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...s,_e,t,r.edited?le(r.edits):"",Ae].join(`
`)}function Se(r,e,t,i,s,n){const{bounds:o,contracted:a}=t.field,{resolution:c,unit:l,steps:f}=t.header,{across:h,edge:u,dims:d}=i,m=o[1].map((x,y)=>x-o[0][y]).map((x,y)=>a?2/x:(c[y]-1)/x),v=o[0].map((x,y)=>a?.5*(x+o[1][y]):x);r.uniform3f(e("atlasScale"),1/(h[0]*u),1/(h[1]*u),1/(h[2]*u)),r.uniform3i(e("indexDims"),...d),r.uniform3i(e("bricksOrigin"),...s.origin),r.uniform3i(e("bricksDims"),...s.dims),r.uniform3i(e("resolution"),...c),r.uniform3fv(e("lower"),v),r.uniform3fv(e("scale"),m),r.uniform3fv(e("halfGrid"),c.map(x=>(x-1)/4)),r.uniform1f(e("unit"),l),r.uniform1f(e("marchStep"),a?n:n/Math.max(...m)),r.uniform1fv(e("coefficientSteps"),f)}function Ue(r,e,t,{width:i,height:s}){const{c2w:n}=t,o=i/t.width,a=s/t.height;r.uniform3f(e("eye"),n[3],n[7],n[11]),r.uniformMatrix3fv(e("rotation"),!0,[n[0],n[1],n[2],n[4],n[5],n[6],n[8],n[9],n[10]]),r.uniform4f(e("lens"),t.fx*o,t.fy*a,t.cx*o,t.cy*a),r.uniform1f(e("height"),s)}class De{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:i,depth:s,normals:n}=this.textures;for(const[o,a]of[i,s,n].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+o,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:i,height:s}=this,n=new Uint8Array(4*i*s),o=e&&this.textures?.normals?new Uint8Array(4*i*s):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,i,s,t.RGBA,t.UNSIGNED_BYTE,n),o&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,i,s,t.RGBA,t.UNSIGNED_BYTE,o)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=B(this.readDepth(),i);return{width:i,height:s,rgba:B(n,4*i),depth:a,normals:o&&B(o,4*i)}}readBits(e,t){const{gl:i}=this,s=new Uint32Array(e*t);if(i.bindBuffer(i.PIXEL_PACK_BUFFER,null),i.pixelStorei(i.PACK_ALIGNMENT,1),i.getParameter(i.IMPLEMENTATION_COLOR_READ_FORMAT)===i.RED_INTEGER)i.readPixels(0,0,e,t,i.RED_INTEGER,i.UNSIGNED_INT,s);else{const n=new Uint32Array(4*e*t);i.readPixels(0,0,e,t,i.RGBA_INTEGER,i.UNSIGNED_INT,n);for(let o=0;o<s.length;o++)s[o]=n[4*o]}return new Float32Array(s.buffer)}wait(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,1,1,e.RGBA,e.UNSIGNED_BYTE,new Uint8Array(4)),e.bindFramebuffer(e.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const i of Object.values(t))e.deleteTexture(i);e.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.readBuffer(e.COLOR_ATTACHMENT1);const t=this.readBits(this.width,this.height);return e.bindFramebuffer(e.FRAMEBUFFER,null),t}texture(e,t){const{gl:i}=this,s=i.createTexture();return i.bindTexture(i.TEXTURE_2D,s),i.texStorage2D(i.TEXTURE_2D,1,e,this.width,this.height),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,t),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,t),i.bindTexture(i.TEXTURE_2D,null),s}}function B(r,e){const t=r.length/e;for(let i=0;i<t>>1;i++){const[s,n]=[i*e,(t-1-i)*e],o=r.slice(s,s+e);r.copyWithin(s,n,n+e),r.set(o,n)}return r}const O=["colour","depth","opacity","normals"],Ie=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 colour;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${O.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${O.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${O.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  colour = vec4(c.rgb, 1.0);
}`,Oe=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;class Fe{constructor(e,t){this.gl=e,this.targets=t}programs=null;small=null;show(e,t,i,s){const{gl:n}=this,{program:o,uniform:a}=this.cached.show;n.viewport(0,0,i,s),n.useProgram(o),this.bind(a),n.activeTexture(n.TEXTURE2),n.bindTexture(n.TEXTURE_2D,this.targets.normals),n.uniform1i(a("normals"),2),n.uniform2f(a("size"),i,s),n.uniform2f(a("reach"),...t),n.uniform1i(a("view"),O.indexOf(e)),n.drawArrays(n.TRIANGLES,0,3)}distances(e){const{gl:t,targets:i}=this,s=Math.max(1,Math.ceil(Math.sqrt(i.width*i.height/e))),[n,o]=[Math.ceil(i.width/s),Math.ceil(i.height/s)];this.bindSmall(n,o);const{program:a,uniform:c}=this.cached.distances;return t.viewport(0,0,n,o),t.useProgram(a),this.bind(c),t.uniform1i(c("stride"),s),t.uniform1i(c("height"),i.height),t.drawArrays(t.TRIANGLES,0,3),t.readBuffer(t.COLOR_ATTACHMENT0),{width:n,height:o,values:i.readBits(n,o)}}forget(){this.programs=this.small=null}dispose(){const{gl:e}=this;for(const{program:t}of Object.values(this.programs??{}))e.deleteProgram(t);e.deleteTexture(this.small?.texture??null),e.deleteFramebuffer(this.small?.framebuffer??null),this.forget()}get cached(){return this.programs??={show:z(this.gl,L,Ie),distances:z(this.gl,L,Oe)},this.programs}bind(e){const{gl:t,targets:i}=this;t.activeTexture(t.TEXTURE0),t.bindTexture(t.TEXTURE_2D,i.colour),t.uniform1i(e("picture"),0),t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,i.depth),t.uniform1i(e("depthBits"),1)}bindSmall(e,t){const{gl:i}=this;if(this.small?.width!==e||this.small.height!==t){i.deleteTexture(this.small?.texture??null),i.deleteFramebuffer(this.small?.framebuffer??null);const s=i.createTexture();i.bindTexture(i.TEXTURE_2D,s),i.texStorage2D(i.TEXTURE_2D,1,i.R32UI,e,t);const n=i.createFramebuffer();i.bindFramebuffer(i.FRAMEBUFFER,n),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,s,0),this.small={texture:s,framebuffer:n,width:e,height:t}}i.bindFramebuffer(i.FRAMEBUFFER,this.small.framebuffer),i.drawBuffers([i.COLOR_ATTACHMENT0])}}const ze=768*2**20;class V{constructor(e,t=ze){this.gl=e,this.memory=t,this.targets=new De(e),this.views=new Fe(e,this.targets),this.onGpu=new ue(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;compileTime=0;compiled=0;shown=null;onGpu;views;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get uploaded(){return this.onGpu.uploaded}get active(){return this.edited?this.onGpu.edits:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const i=++this.loading,s=()=>i===this.loading;let n=0;for await(const o of Te(e,t.onArrival)){if(await this.take(o,s),!s())return;t.onLevel?.(++n,o.field.levels.length)}}async restore(){const{shown:e}=this,{edits:t}=this.onGpu;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=null;for(const s of[this.targets,this.views,this.onGpu])s.forget();const i=++this.loading;e&&await this.take(e.level,()=>i===this.loading),this.setEdits(t)}setEdits(e){this.onGpu.set(e)}render(e={}){const{gl:t,shown:i,camera:s,active:n}=this;if(!i||!s||t.isContextLost())return!1;const{level:o,textures:a}=i,{width:c,height:l}=this.targets,f={K:o.header.steps.length,contracted:o.field.contracted,edited:n!==null,edits:n&&ce(n.edits),normals:e.normals??!1,count:e.count??!1},{program:h,uniform:u}=this.program(f,o.field.brick);this.targets.bind(f.normals),t.useProgram(h),t.bindVertexArray(this.vertices),this.plainState();const d=n&&o.last?n.occupancy:o.occupancy;Se(t,u,o,a.layout,d,this.step??o.field.step),Ue(t,u,s,this.targets),t.uniform1f(u("near"),this.near),t.uniform3f(u("background"),...this.background);let p=0;const m=(w,I,$)=>{t.activeTexture(t.TEXTURE0+p),t.bindTexture(I,$),t.uniform1i(u(w),p++)};m("densityAtlas",t.TEXTURE_3D,a.density),m("brickIndex",t.TEXTURE_3D,a.index),m("bricks",t.TEXTURE_3D,n?this.deformed(i):i.occupancy),a.colours.forEach((w,I)=>m(`colourAtlas${I}`,t.TEXTURE_3D,w)),n&&(m("lattice",t.TEXTURE_2D,this.onGpu.bind(h)),t.uniform1i(u("editCount"),n.edits),t.uniform1i(u("boxCount"),n.boxes),t.uniform1i(u("preserveOpacity"),Number(n.preserveOpacity)));const{first:v,count:x}=e.rows??{first:0,count:l},y=e.columns??{first:0,count:c};return t.enable(t.SCISSOR_TEST),t.scissor(y.first,v,y.count,x),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),this.unbind(),!0}show(e,t,i=null,s="colour"){const{gl:n}=this;n.bindFramebuffer(n.FRAMEBUFFER,i),n.bindVertexArray(this.vertices),this.plainState(),this.views.show(s,this.reach,e,t),this.unbind()}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),this.plainState();const t=this.views.distances(e);return this.unbind(),t}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const e of[this.targets,this.views,this.onGpu])e.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const i=await xe(this.gl,e,this.memory,t);i!==null&&(this.drop(),this.shown={level:e,textures:i,occupancy:q(this.gl,e.occupancy),solid:null})}drop(){this.shown&&(ve(this.gl,this.shown.textures),this.gl.deleteTexture(this.shown.occupancy),this.gl.deleteTexture(this.shown.solid),this.shown=null)}deformed(e){if(e.level.last)return this.onGpu.bricks;const{occupancy:t}=e.level;return e.solid??=q(this.gl,{...t,codes:new Uint16Array(t.codes.length).fill(255)}),e.solid}get reach(){const{shown:e,camera:t}=this;if(!e||!t)return[0,1];const[i,s]=e.level.field.bounds,n=.5*Math.hypot(...s.map((a,c)=>a-i[c])),o=Math.hypot(...s.map((a,c)=>.5*(a+i[c])-t.c2w[4*c+3]));return[Math.max(0,o-n),o+n]}program(e,t){const i=JSON.stringify([e,t]);let s=this.programs.get(i);return s||(s=z(this.gl,L,Me(e,t)),this.programs.set(i,s),this.compileTime=s.milliseconds,this.compiled+=1),s}plainState(){const{gl:e}=this;for(const t of[e.BLEND,e.DEPTH_TEST,e.CULL_FACE,e.STENCIL_TEST,e.SCISSOR_TEST,e.DITHER])e.disable(t);e.colorMask(!0,!0,!0,!0),e.depthMask(!1)}unbind(){const{gl:e}=this;for(let t=15;t>=0;t--)e.activeTexture(e.TEXTURE0+t),e.bindTexture(e.TEXTURE_2D,null),e.bindTexture(e.TEXTURE_3D,null);e.bindVertexArray(null),e.bindFramebuffer(e.FRAMEBUFFER,null),e.useProgram(null)}}async function K(r,e=null){const t=await S.open(new N(r),"cageedit",2),{header:i}=t,s=await t.read("rows"),n=[];for(const[u,{key:d}]of i.lattices.entries()){const p=[...n,...e?.lattices??[]].find(m=>m.key===d);n.push(p??{key:d,halves:k(await t.read(`lattice.${u}`))})}const{key:o,origin:a,dims:c,part:l}=i.occupancy,f=e?.occupancy??null;let h;if(f?.key===o)h=f;else{const u=await t.read("occupancy");if(l===null)h={key:o,origin:a,dims:c,codes:u,changed:null};else if(f?.key===l.of)h={key:o,origin:a,dims:c,codes:Ce(f,l.low,l.dims,u),changed:{...l,codes:u}};else throw new Error("the edits are the change of ones that this page has not")}return{edits:i.edits,boxes:i.boxes,preserveOpacity:i.preserve_opacity,rows:s,lattices:n,occupancy:h}}function Ce({dims:r,codes:e},t,i,s){const n=e.slice();let o=0;for(let a=t[0];a<t[0]+i[0];a++)for(let c=t[1];c<t[1]+i[1];c++,o+=i[2])n.set(s.subarray(o,o+i[2]),(a*r[1]+c)*r[2]+t[2]);return n}const Y=new Map;function j(r){let e=Y.get(r);if(!e){let t;const i=new ReadableStream({start:s=>void(t=s)});if(!t)throw new Error("a stream without a controller");Y.set(r,e={stream:i,controller:t})}return e}function Ne(r,e){document.currentScript?.remove();const{controller:t}=j(r);try{e===null?t.close():t.enqueue(ke(e))}catch{}}function ke(r){const e=atob(r),t=new Uint8Array(e.length);for(let i=0;i<e.length;i++)t[i]=e.charCodeAt(i);return t}async function P(r,{url:e}){if(e===void 0)return j(r).stream;if(location.protocol==="file:")throw new Error("A page may not read files beside it from a disk: open it by a web server (python -m http.server), or export one .html file.");const t=await fetch(e);if(!t.ok||t.body===null)throw new Error(`${e} cannot be loaded (${t.status}); reload the page.`);return t.body}async function Le(r){return await new Response(r).arrayBuffer()}const G=[1,.75,.5,.35,.25,.18,.12];class Be{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const i=t/Math.max(1,e);this.cost=this.cost===null?i:this.cost+.3*(i-this.cost)}scale(e,t){const{cost:i}=this;return i===null?.25:G.find(s=>i*e*t*s*s<=this.moving)??G[G.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function Pe(r){const e=performance.now(),t=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0);if(r.flush(),t===null)return 0;for(;!r.isContextLost()&&r.clientWaitSync(t,0,0)===r.TIMEOUT_EXPIRED;)await new Promise(i=>setTimeout(i,1));return r.deleteSync(t),performance.now()-e}const J=(r,e)=>Math.hypot(r.x-e.x,r.y-e.y);function Ge(r,e){const t=new Map;let i=!1;const s=()=>{const n=[...t.values()];if(n.length===0)return;const o=n.slice(0,2),a=f=>o.reduce((h,{at:u,from:d})=>h+u[f]-d[f],0)/o.length,[c,l]=[a("x"),a("y")];if(o.length===2||o[0].shifts?(c!==0||l!==0)&&e.shift(c,l):(c!==0||l!==0)&&e.turn(c,l),o.length===2){const[f,h]=[J(o[0].from,o[1].from),J(o[0].at,o[1].at)];f>1&&h>1&&f!==h&&e.zoom(f/h)}for(const f of n)f.from=f.at};r.style.touchAction="none",r.addEventListener("contextmenu",n=>n.preventDefault()),r.addEventListener("pointerdown",n=>{r.setPointerCapture(n.pointerId),s();const o={x:n.clientX,y:n.clientY};t.set(n.pointerId,{at:o,from:o,shifts:n.button!==0||n.shiftKey})});for(const n of["pointerup","pointercancel"])r.addEventListener(n,o=>{s(),t.delete(o.pointerId)});r.addEventListener("pointermove",n=>{const o=t.get(n.pointerId);o&&(o.at={x:n.clientX,y:n.clientY},!i&&(i=!0,requestAnimationFrame(()=>{i=!1,s()})))}),r.addEventListener("wheel",n=>{n.preventDefault();const o=n.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*o*n.deltaY))},{passive:!1})}const E=(r,e,t=1)=>[r[0]+t*e[0],r[1]+t*e[1],r[2]+t*e[2]],T=(r,e)=>E(r,e,-1),F=(r,e)=>[e*r[0],e*r[1],e*r[2]],b=(r,e)=>r[0]*e[0]+r[1]*e[1]+r[2]*e[2],U=(r,e)=>[r[1]*e[2]-r[2]*e[1],r[2]*e[0]-r[0]*e[2],r[0]*e[1]-r[1]*e[0]],Z=r=>Math.hypot(...r),R=r=>F(r,1/Math.max(1e-30,Z(r)));function Q(r,e,t){const[i,s]=[Math.cos(t),Math.sin(t)];return E(E(F(r,i),U(e,r),s),e,b(e,r)*(1-i))}const g=(r,e)=>[r[e],r[4+e],r[8+e]];function ee(r,e,t,i){return[0,1,2].flatMap(s=>[r[s],e[s],t[s],i[s]]).concat(0,0,0,1)}const te=.02;class re{constructor(e,t,i){this.up=t,this.eye=g(e,3);const s=F(g(e,2),-1);this.target=E(this.eye,s,Math.max(b(T(i,this.eye),s),.001))}eye;target;get c2w(){const e=R(T(this.eye,this.target)),t=R(U(this.up,e));return ee(t,U(e,t),e,this.eye)}turn(e,t){const i=Q(T(this.eye,this.target),this.up,-e),s=R(U(this.up,i)),n=Math.acos(Math.max(-1,Math.min(1,b(R(i),this.up)))),o=Math.max(te,Math.min(Math.PI-te,n-t))-n;this.eye=E(this.target,Q(i,s,o))}shift(e,t,i){const s=2*i*Z(T(this.eye,this.target)),{c2w:n}=this,o=E(F(g(n,0),-e*s),g(n,1),t*s);this.eye=E(this.eye,o),this.target=E(this.target,o)}zoom(e){this.eye=E(this.target,T(this.eye,this.target),e)}}function Xe({stills:r,seconds:e,loop:t},i){const s=e>0?i/e:1,n=r.length-1,o=t?s%1*r.length:Math.min(s,1)*n,a=r[Math.min(Math.floor(o),n)],c=r[t?(Math.floor(o)+1)%r.length:Math.min(Math.floor(o)+1,n)],l=o-Math.floor(o),f=p=>E(g(a.c2w,p),T(g(c.c2w,p),g(a.c2w,p)),l),h=R(f(2)),u=f(1),d=R(T(u,[h[0]*b(u,h),h[1]*b(u,h),h[2]*b(u,h)]));return{c2w:ee(U(d,h),d,h,f(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}let D=null;function $e(){if(D)return D;D=new Float32Array(65536);for(let r=0;r<65536;r++){const e=r>>10&31,t=r&1023,i=e===0?t*2**-24:(1+t/1024)*2**(e-15);D[r]=r&32768?-i:i}return D}const ie=new Float32Array(1),se=new Uint32Array(ie.buffer);function We(r){ie[0]=r;const e=se[0]>>>16&32768,t=se[0]&2147483647;return t>=947912704?e|t-939524096+4095+(t>>>13&1)>>>13:e|Math.round(Math.abs(r)*2**24)}function He(r,e,t){const i=$e(),s=new Uint16Array(r.length);for(let n=0;n<s.length;n++){const o=i[r[n]];s[n]=We(o+t*(i[e[n]]-o))}return s}const qe=[0,12,30];class X{constructor(e,t,i,s,n){this.header=e,this.times=t,this.order=i,this.occupancy=s,this.states=n}static async read(e){const t=await S.open(new N(e),"cagepath",1),{header:i}=t,s=await t.read("times"),n=await t.read("states"),o=await t.read("occupancy"),a=[],c=[];for(const h of i.edits.keys())a.push(await t.read(`rows.${h}`));for(let h=0;h<i.stored;h++)c.push({key:`${h}`,halves:k(await t.read(`lattice.${h}`))});const l=i.edits.map((h,u)=>({edits:h,boxes:i.boxes[u],rows:a[u],lattices:i.lattices[u].map(d=>c[d])})),f={key:"path",origin:i.origin,dims:i.dims,codes:o,changed:null};return new X(i,s,n,f,l)}at(e){const{times:t,order:i,states:s}=this,n=t.length-1;let o=0;for(;o<n-1&&t[o+1]<=e;)o++;const a=Math.max(0,Math.min(1,(e-t[o])/Math.max(1e-9,t[o+1]-t[o]))),c=s[i[o]],l=s[i[o+1]],f=a<.5?c:l;if(c===l||!Ve(c,l))return this.edits(f,f.rows,f.lattices);const h=c.lattices.map((u,d)=>u===l.lattices[d]?u:{key:`${u.key} ${l.lattices[d].key} ${a}`,halves:He(u.halves,l.lattices[d].halves,a)});return this.edits(c,Ke(c,l,a),h)}edits({edits:e,boxes:t},i,s){return{edits:e,boxes:t,preserveOpacity:this.header.preserve_opacity,rows:i,lattices:s,occupancy:this.occupancy}}}function Ve(r,e){if(r.edits!==e.edits||r.boxes!==e.boxes)return!1;for(let t=3;t<r.rows.length;t+=4)if(r.rows[t]!==e.rows[t])return!1;return!0}function Ke({edits:r,boxes:e,rows:t},{rows:i},s){const n=t.map((a,c)=>a+s*(i[c]-a)),o=a=>{for(let c=4*a;c<4*a+3;c++)n[c]=Math.min(t[c],i[c]);for(let c=4*a+4;c<4*a+7;c++)n[c]=Math.max(t[c],i[c])};for(let a=0;a<r;a++)for(const c of qe)o(a*44+c);for(let a=0;a<e;a++)o(r*44+2*a);return n}const Ye=120,je=2;class Je{constructor(e,t,i,s=()=>{}){this.canvas=e,this.header=t,this.say=i,this.arrived=s;const n=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!n)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=n,this.renderer=new V(n),this.renderer.background=t.background??[1,1,1],this.orbit=new re(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,Ge(e,{turn:(o,a)=>this.change(()=>this.orbit.turn(Math.PI*o/e.clientHeight,Math.PI*a/e.clientHeight)),shift:(o,a)=>this.change(()=>this.orbit.shift(o/e.clientHeight,a/e.clientHeight,this.tangent)),zoom:o=>this.change(()=>this.orbit.zoom(o))}),e.addEventListener("webglcontextlost",o=>o.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new Be;fov;moved=performance.now();row=0;sketched=!1;pictures=0;playing=null;edits;along=null;canPlay=!1;async run(){const{files:e}=this.header;this.draw();const t=await P("field",e.field);let i;await this.renderer.load(t,{onArrival:s=>this.arrived(Math.min(.99,s/e.field.bytes)),onLevel:(s,n)=>{this.say(s<n?"Loading detail …":""),i??=this.loadEdits(),this.touch()}}),await i,e.path&&(this.along=await X.read(await P("path",e.path))),this.canPlay=this.header.path!==null,this.arrived(1)}async loadEdits(){const{files:e}=this.header;this.edits=e.edits?await K(await Le(await P("edits",e.edits))):null,this.renderer.setEdits(this.edits),this.touch()}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.canPlay?performance.now():null,this.touch()}home(){this.playing=null,this.edits!==void 0&&this.renderer.setEdits(this.edits),this.look(this.header.start)}seek(e,t){const i=e.loop?t%e.seconds:Math.min(t,e.seconds);this.along&&this.renderer.setEdits(this.along.at(i)),this.look(Xe(e,i))}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new re(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0,this.sketched=!1}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:i,pacing:s}=this,{path:n}=this.header;if(this.playing!==null&&n){const v=(performance.now()-this.playing)/1e3;this.seek(n,v),!n.loop&&v>=n.seconds&&(this.playing=null)}if(this.row===null||i.level?.last&&this.edits===void 0)return;const o=Math.min(devicePixelRatio,je),[a,c]=[e.clientWidth,e.clientHeight].map(v=>Math.max(1,Math.round(v*o)));(e.width!==a||e.height!==c)&&Object.assign(e,{width:a,height:c});const l=s.scale(a,c),f=this.sketched&&performance.now()-this.moved>Ye||l===1,h=f?[a,c]:[a,c].map(v=>Math.max(8,Math.round(v*l)));this.aim(h[0],h[1]);const u=f?this.row:0,d=f?Math.min(s.rows(a,c),c-u):h[1],p=this.moved;if(!i.render({rows:{first:u,count:d}}))return;const m=u+d>=h[1];m&&(i.show(a,c),this.pictures++),s.took(h[0]*d,await Pe(t)),this.moved===p&&(this.sketched=!0,f&&(this.row=m?null:u+d))}aim(e,t){const i=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:i,fy:i,cx:e/2,cy:t/2})}}window.cagefieldViewer={FieldRenderer:V,readEdits:K,take:Ne};function _(r){const e=document.querySelector(r);if(!e)throw new Error(`the page has no ${r}`);return e}async function Ze(r){const e=_(".message"),t=_(".arrived"),i=s=>void(e.textContent=s);try{const s=new Je(_("canvas"),r,i,c=>{t.value=c,t.hidden=c>=1});window.cagefieldViewer.viewer=s;const[n,o,a]=[_(".compare"),_(".play"),_(".home")];n.hidden=!r.files.edits,n.onclick=()=>s.edited=!s.edited,o.onclick=()=>s.play(!s.plays),a.onclick=()=>s.home(),setInterval(()=>{o.hidden=!s.canPlay,o.textContent=s.plays?"Stop":"Play",n.textContent=s.edited?"Show before":"Show after"},100),window.addEventListener("keydown",({key:c,target:l})=>{c==="b"&&n.click(),c===" "&&!(l instanceof HTMLButtonElement)&&o.click(),c==="h"&&a.click()}),await s.run()}catch(s){t.hidden=!0,i(s instanceof Error?s.message:String(s))}}const ne=document.getElementById("scene");ne&&Ze(JSON.parse(ne.textContent))})();
